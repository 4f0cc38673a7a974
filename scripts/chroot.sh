# A bare Debian to try things in, for scripts that source this; needs root.

# make_chroot FOLDER LOG [SUITE]: of Debian 12 unless named; later ones from the mirror of this one.
make_chroot() {
    local mirror suite=${3:-bookworm} script=/usr/share/debootstrap/scripts
    mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
        awk '$2 == "bookworm" && $3 == "main" { print $1; exit }')
    command -v debootstrap >/dev/null || apt-get -qq install --no-install-recommends -y debootstrap
    [ -e "$script/$suite" ] && script+=/$suite || script+=/sid # newer than debootstrap
    rm -rf --one-file-system "$1" # it has mounts where debootstrap was interrupted
    debootstrap --variant=minbase "$suite" "$1" "${mirror:?no Debian 12 in the sources of apt}" "$script" >"$2"
}
