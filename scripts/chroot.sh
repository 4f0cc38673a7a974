# A bare Debian 12 to try things in, for scripts that source this; needs root.

# make_chroot FOLDER LOG
make_chroot() {
    local mirror
    mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
        awk '$2 == "bookworm" && $3 == "main" { print $1; exit }')
    command -v debootstrap >/dev/null || apt-get -qq install --no-install-recommends -y debootstrap
    rm -rf --one-file-system "$1" # it has mounts where debootstrap was interrupted
    debootstrap --variant=minbase bookworm "$1" "${mirror:?no Debian 12 in the sources of apt}" >"$2"
}
