#!/usr/bin/env bash
# Makes the wheel mildground-cuda, the package mild_cuda, build/dist/mildground_cuda-*.whl, with the compiler and libraries of NVIDIA's packages for Python: no toolkit
# and no GPU is needed. Tries it beside build/dist/mildground-*.whl (scripts/wheels.sh), on a GPU if there is one. An architecture takes 20
# minutes of two busy cores. Usage: [ARCHS="90"] scripts/wheel_cuda.sh
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD/build/dist archs=${ARCHS:-80 90-real 100-real 120} # 80: also 86 and 89, and as PTX whatever has no code of its own
tools=$root/tools cuda=$root/cuda
mkdir -p "$root"
scripts/setup.sh cuda
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
rm -rf "$root"/raw-cuda "$root"/mildground_cuda-*.whl
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation -w "$root/raw-cuda" python/cuda \
    --config-settings=cmake.define.CUDAToolkit_ROOT="$toolkit" --config-settings=cmake.define.CMAKE_CUDA_ARCHITECTURES="${archs// /;}"
auditwheel repair --exclude 'libmujoco.so.*' --exclude 'libcublas*.so.*' --wheel-dir "$root" "$root"/raw-cuda/mildground_cuda-*.whl >/dev/null 2>&1
wheel=$(echo "$root"/mildground_cuda-*.whl)
echo "wheel_cuda: $(basename "$wheel") for $archs, $(($(stat -c %s "$wheel") / 1000000)) MB, made in $((SECONDS - begin)) s"
abi3audit --strict "$wheel" >/dev/null

plain=$(echo "$root"/mildground-*.whl) try=$root/try-cuda
[ -e "$plain" ] || { echo "wheel_cuda: not tried, because scripts/wheels.sh has made no build/dist/mildground-*.whl" >&2; exit 1; }
rm -rf "$try"
.venv/bin/python -m venv "$try"
"$try/bin/pip" install --quiet --disable-pip-version-check --require-hashes -r scripts/wheel.txt
"$try/bin/pip" install --quiet --disable-pip-version-check --no-deps "$plain" "$wheel"
ln -s "$(dirname "$toolkit")" "$(echo "$try"/lib/python3*/site-packages)/nvidia" # the package nvidia-cublas
cd "$try"
export MILD_PROCESSOR=cuda
bin/python - <<'PYTHON'
import mild
from mild import envs
assert "/mild_cuda/_ground" in mild._ground.__file__, mild._ground.__file__
sole = mild.Sole.plate(0.2, 0.1)
for what in (lambda: mild.Batch(4, [sole, sole], dt=0.005, device="cuda"), lambda: envs.open_envs(4, device="cuda")):
    try:
        what()
    except ValueError as error:
        assert "device 0 is not there" in str(error), error
assert "/mild_cuda/" in mild.envs.load().__file__
PYTHON
bin/mild info devices | sed -n 's/^GPU */wheel_cuda: tried here: /p'
cd - >/dev/null
rm -rf "$try"
