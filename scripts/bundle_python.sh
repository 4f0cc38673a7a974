#!/usr/bin/env bash
# Adds the Python package's environments to build/bundle (scripts/bundle.sh), for another machine's Python: build/bundle/python,
# to be named in PYTHONPATH; lab/paper/rivals finds it there. Its mild._envs is linked to the bundle's libmild_envs.so, so that no
# kernel is compiled again.
# Usage: [BUILD=build/x86-64-v3] scripts/bundle_python.sh PYTHON, an interpreter of that machine's version with its headers, e.g. python3.12
set -euo pipefail
cd "$(dirname "$0")/.."
other=${1:?usage: scripts/bundle_python.sh PYTHON}
bundle=build/bundle
package=$bundle/python/mild
nanobind=$(.venv/bin/python -c 'import nanobind; print(nanobind.__path__[0])')
include=$("$other" -c 'import sysconfig; print(sysconfig.get_path("include"))')
suffix=$("$other" -c 'import sysconfig; print(sysconfig.get_config_var("EXT_SUFFIX"))')
[ -e "$bundle/lib/libmild_envs.so" ] || { echo "bundle_python: run scripts/bundle.sh first" >&2; exit 2; }
[ -e "$include/Python.h" ] || { echo "bundle_python: $other has no headers ($include/Python.h)" >&2; exit 2; }

# Archives of the build that the bundle is made of, with its kernels where it has some.
build=${BUILD:-build/x86-64-v3}/src
archives=("$build"/liblayer_{identify,soil,batch,models,step,sole,terrain,law,device,base}.a)
cuda=()
if [ -e "$build/libbatch_device.a" ]; then
    archives+=("$build"/lib{batch_device,device_gpu}.a)
    cuda=(-L"$(dirname "$(readlink -f "$(command -v nvcc || echo /usr/local/cuda/bin/nvcc)")")/../lib64" -lcudart_static -ldl -lrt)
fi

rm -rf "$bundle/python"
mkdir -p "$package"
cp -r python/mild/{*.py,py.typed,layouts} "$package/"
ln -s ../.. "$package/data"
flags=(-O2 -std=c++17 -fPIC -shared -fvisibility=hidden -march=x86-64-v3 -Iinclude -Isrc -I"$include" -I"$nanobind/include"
    -I"$nanobind/ext/robin_map/include" "$nanobind/src/nb_combined.cpp"
    -DMILD_VERSION="\"$(sed -n 's/^project(mild VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)\"")
g++ "${flags[@]}" python/src/envs.cpp -o "$package/_envs$suffix" -L"$bundle/lib" -lmild_envs -Wl,-rpath,'$ORIGIN/../../lib' \
    -Wl,--allow-shlib-undefined &
g++ "${flags[@]}" python/src/{ground,material,terrain,press,fit,batch,xla}.cpp -o "$package/_ground$suffix" \
    -Wl,--start-group "${archives[@]}" -Wl,--end-group "${cuda[@]}" -Wl,--exclude-libs,ALL
wait $!
strip "$package"/*.so
du -sh "$bundle/python"
