#!/usr/bin/env bash
# Makes the Debian package build/deb/mild_VERSION_ARCH.deb. With `test` also installs it in a bare chroot of Debian 12 and uses
# it there as a user without root would; needs root and debootstrap. Usage: scripts/deb.sh [test]
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)} root=$PWD/build/deb chroot=$PWD/build/deb/chroot
source scripts/chroot.sh

make_package() {
    local launcher=()
    ! command -v ccache >/dev/null || launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache)
    # several processes need MPI at run time, which is large: build from source for that
    cmake -S . -B "$root" -DCMAKE_BUILD_TYPE=Release --log-level=WARNING -DMILD_MARCH=x86-64-v3 -DMILD_MPI=OFF \
        -DMILD_LAB=ON -DMILD_TESTS=OFF -DMILD_DATA_DIR=/usr/share/mild -DCMAKE_INSTALL_PREFIX=/usr "${launcher[@]}"
    cmake --build "$root" --parallel "$jobs" --target mild mild_shared mild_static mild_batch_shared mild_batch_static mild_envs >/dev/null
    rm -rf "$root"/mild_*.deb "$root/web"
    if command -v emcc >/dev/null; then
        scripts/web.sh "$root"
    else
        echo "deb: without the page of \`mild web\`, because emcc is missing; \`scripts/setup.sh web\` installs it" >&2
    fi
    (cd "$root" && cpack -D CPACK_PACKAGE_VERSION="$(./mild --version | cut -d' ' -f2)" >/dev/null)
    package=$(echo "$root"/mild_*.deb)
    if [ -e "$root/web" ]; then # the page, as it was made
        rm -rf "$root/inside"
        dpkg-deb -x "$package" "$root/inside"
        diff -r "$root/web" "$root/inside/usr/share/mild/build/web" || { echo "deb: not the page of $root/web" >&2; return 1; }
        rm -rf "$root/inside"
    fi
    echo "deb: $package, $(du -h "$package" | cut -f1)"
}

# inside COMMAND...: in the chroot, as nobody, in an empty folder.
inside() {
    chroot "$chroot" su -s /bin/bash nobody -c 'cd "$(mktemp -d)" && '"$*"
}

test_package() {
    make_chroot "$chroot" "$root/debootstrap.log"
    mount -t proc proc "$chroot/proc" # programs find themselves by it
    trap 'umount "$chroot/proc"' EXIT
    cp "$package" "$chroot/tmp/mild.deb"
    chroot "$chroot" apt-get -qq install --no-install-recommends -y /tmp/mild.deb >"$root/install.log" 2>&1 ||
        { tail -20 "$root/install.log" >&2; return 1; }
    [ "mild $(dpkg-deb -f "$package" Version)" = "$(inside mild --version)" ]
    inside 'mild info robots' | grep '^sa01: 12 joints' >/dev/null
    inside 'mild press --ground foam45 --plate 0.1,0.1 --csv press.csv && mild fit press.csv --plate 0.1,0.1 --hold alpha=1.05' |
        grep 'k_pen' >/dev/null
    inside 'mild eval --ground rigid,foam45 --trials 1 --seconds 3' | grep -c ' 1/1 ' | grep -x 2 >/dev/null
    inside 'mild train --out run --train.envs=16 --train.minutes=0 --train.iterations=2 --ppo.steps=4 --ppo.minibatches=2 &&
        mild eval --policy run/policy.safetensors --trials 1 --seconds 0.1 && { mild report run 2>&1 || true; }' |
        grep 'install python3' >/dev/null # which is but recommended
    if command -v help2man >/dev/null; then
        inside 'zcat /usr/share/man/man1/mild.1.gz' | grep -x report >/dev/null
    fi
    if [ -e "$root/web" ]; then
        inside '{ mild web 2>&1 || true; }' | grep 'install python3' >/dev/null # which is but recommended
    else
        inside '{ mild web 2>&1 || true; }' | grep 'this installation has no page' >/dev/null
    fi
    # nothing but the package's own folders, no path of the machine that built it, and all gone in the end
    ! chroot "$chroot" dpkg -L mild | grep -vE '^(/\.|/usr(/bin|/include|/lib|/share)?(/.*)?)$' || return 1
    ! grep -rlF "$PWD" "$chroot/usr/bin/mild" "$chroot/usr/share/mild" "$chroot/usr/share/doc/mild" "$chroot/usr/lib/mild" || return 1
    chroot "$chroot" apt-get -qq purge -y mild >>"$root/install.log" 2>&1
    [ ! -e "$chroot/usr/bin/mild" ] && [ ! -e "$chroot/usr/share/mild" ] && [ ! -e "$chroot/usr/lib/mild" ]
    umount "$chroot/proc"
    trap - EXIT
    rm -rf --one-file-system "$chroot"
    echo "deb: installed in a bare Debian 12, used there without root, removed"
}

make_package
if [ "${1:-}" = test ]; then
    trap 'echo "deb: failed at line $LINENO: $BASH_COMMAND" >&2' ERR
    set -E
    test_package
fi
