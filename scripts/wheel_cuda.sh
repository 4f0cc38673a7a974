#!/usr/bin/env bash
# Makes the wheel mild_cuda, build/dist/mild_cuda-*.whl, with the compiler and libraries of NVIDIA's packages for Python: no toolkit
# and no GPU is needed. The default architectures take hours of two cores. Usage: [ARCHS="90"] scripts/wheel_cuda.sh
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD/build/dist archs=${ARCHS:-80-real 86-real 89-real 90-real 100-real 120}
tools=$root/tools cuda=$root/cuda
mkdir -p "$root"
# install FOLDER FILE.txt: an environment with these packages.
install() {
    cmp -s "$2" "$1/installed" && return
    .venv/bin/python -m venv --clear "$1"
    "$1/bin/pip" install --quiet --disable-pip-version-check --require-hashes -r "$2"
    cp "$2" "$1/installed"
}
install "$tools" scripts/wheels.txt
install "$cuda" scripts/cuda.txt
toolkit=$(echo "$cuda"/lib/python3*/site-packages/nvidia/cu13)
# as in a toolkit: the names that a linker looks for
for library in cudart cublas cublasLt; do
    ln -sf "lib$library.so.13" "$toolkit/lib/lib$library.so"
done
[ -e "$toolkit/lib64" ] || ln -s lib "$toolkit/lib64"

if command -v ccache >/dev/null; then
    export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache CMAKE_CUDA_COMPILER_LAUNCHER=ccache
fi
export PATH=$tools/bin:$PATH CUDACXX=$toolkit/bin/nvcc
begin=$SECONDS
rm -rf "$root"/raw-cuda "$root"/mild_cuda-*.whl
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation -w "$root/raw-cuda" python/cuda \
    --config-settings=cmake.define.CUDAToolkit_ROOT="$toolkit" --config-settings=cmake.define.CMAKE_CUDA_ARCHITECTURES="${archs// /;}"
auditwheel repair --exclude 'libmujoco.so.*' --exclude 'libcublas*.so.*' --wheel-dir "$root" "$root"/raw-cuda/mild_cuda-*.whl >/dev/null 2>&1
ls -la "$root"/mild_cuda-*.whl
echo "wheel_cuda: for $archs, made in $((SECONDS - begin)) s"
