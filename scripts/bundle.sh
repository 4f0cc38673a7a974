#!/usr/bin/env bash
# Makes build/bundle: the program without drawing, the environments as a library, with CUDA, and all libraries that they need
# except libc and CUDA's. Copy the folder to a machine with only an NVIDIA driver and cuBLAS 13. docs/gpu.md says how to use it.
# Usage: scripts/bundle.sh [ranks]; with `ranks` for several GPUs (docs/ranks.md): Open MPI of this machine comes along, and
# that machine has NCCL 2 too.
set -euo pipefail
cd "$(dirname "$0")/.."
bundle=build/bundle
jobs=${JOBS:-$(nproc)}

ranks=(-DMILD_MPI=OFF)
[ "${1:-}" != ranks ] || ranks=(-DMILD_MPI=ON -DMILD_NCCL=ON)

scripts/setup.sh cuda
rm -rf "$bundle"
mkdir -p "$bundle/bin" "$bundle/lib"
sizes=engine_sizes # of the first build, because the second may not run here
for march in x86-64-v3 x86-64-v4; do
    cmake -S . -B "build/$march" -DCMAKE_BUILD_TYPE=Release --log-level=WARNING -DMILD_LAB=ON -DMILD_CUDA=ON -DMILD_VIEW=OFF "${ranks[@]}" \
        -DMILD_MARCH=$march -DMILD_ENGINE_SIZES="$sizes" -DCMAKE_EXE_LINKER_FLAGS=-Wl,--disable-new-dtags \
        -DCMAKE_BUILD_RPATH='$ORIGIN/../lib' >/dev/null
    cmake --build "build/$march" --parallel "$jobs" --target mild mild_envs gpu_test_gpu gpu_test_parts \
        batch_test_batch ranks_test_ranks >/dev/null
    strip -o "$bundle/bin/mild-$march" "build/$march/mild"
    sizes=$PWD/build/$march/src/engine_sizes
done
strip -o "$bundle/bin/test_gpu" build/x86-64-v3/tests/gpu_test_gpu
strip -o "$bundle/bin/test_parts" build/x86-64-v3/tests/gpu_test_parts
strip -o "$bundle/bin/test_batch" build/x86-64-v3/tests/batch_test_batch
strip -o "$bundle/bin/test_ranks" build/x86-64-v3/tests/ranks_test_ranks

# Open MPI for one machine: it finds its plugins and texts below OPAL_PREFIX, as below its own prefix, and its PMIx those in
# PMIX_PKGLIBDIR. Those for networks and batch systems stay here.
programs=(build/x86-64-v3/mild build/x86-64-v3/tests/gpu_test_gpu)
if [ "${1:-}" = ranks ]; then
    place() { ompi_info --parsable --path "$1" | cut -d: -f3; }
    for folder in "$(place pkglibdir)" "$(place pkgdatadir)"; do
        mkdir -p "$bundle${folder#"$(place prefix)"}"
        cp -rL "$folder/." "$bundle${folder#"$(place prefix)"}"
    done
    find "$bundle" -name 'mca_*.so' | grep -E '_(ucx|ofi|openib|psm2?|slurm|flux|jsm|gridengine|simulator|romio[0-9]*|bzip)\.so$' |
        xargs rm
    pmix=$(dirname "$(readlink -f "$(ldconfig -p | awk '/libpmix\.so\.2/ { print $NF; exit }')")")/pmix
    [ ! -d "$pmix" ] || cp -r "$pmix" "$bundle/lib/"
    mkdir "$bundle/libexec"
    cp -L "$(place bindir)/orterun" "$bundle/libexec/mpirun"
    cp -L "$(place bindir)/orted" "$bundle/bin/"
    mapfile -t plugins < <(find "$bundle" -name 'mca_*.so')
    programs+=("$bundle/libexec/mpirun" "$bundle/bin/orted" "${plugins[@]}")
    cat >"$bundle/bin/mpirun" <<'MPIRUN'
#!/bin/sh
here=$(dirname "$(dirname "$(readlink -f "$0")")")
export OPAL_PREFIX="$here" PMIX_PKGLIBDIR="$here/lib/pmix" LD_LIBRARY_PATH="$here/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
exec "$here/libexec/mpirun" "$@"
MPIRUN
    chmod +x "$bundle/bin/mpirun"
    cp scripts/gpus.py scripts/ranks.py scripts/ranks_model.py "$bundle/"
fi

# the libraries that ldd lists, without libc, the loader, CUDA and NCCL
ldd "${programs[@]}" | awk '$2 == "=>" { print $3 }' | sort -u |
    grep -Ev '/(libc|libm|libdl|librt|libpthread|libcublas|libcublasLt|libnccl)\.so' | xargs -I{} cp -L {} "$bundle/lib/"
find "$bundle/lib" -name '*.so*' -type f -exec strip {} +
strip -o "$bundle/lib/libmild_envs.so" build/x86-64-v3/libmild_envs.so
cp -r --parents lab/paper/rivals "$bundle/"
cp -r robots configs policies LICENSE NOTICE "$bundle/"
cp --parents python/mild/report.py "$bundle/" # mild report
cp .venv/daqp-*/LICENSE "$bundle/LICENSE-DAQP" # parts of the program
cp .venv/cutlass/licenses/LICENSE.txt "$bundle/LICENSE-CUTLASS"

cat >"$bundle/run" <<'RUN'
#!/bin/sh
# run PROGRAM ARGUMENTS: starts this folder's mild, test_gpu or mpirun, or a script, with the cuBLAS and NCCL of this machine.
here=$(dirname "$(readlink -f "$0")")
program=$1
shift
wheel=$(python3 -c 'import nvidia; print(list(nvidia.__path__)[0])' 2>/dev/null)
for library in libcublas.so.13 libnccl.so.2; do
    for folder in /usr/local/cuda*/lib64 /usr/local/cuda*/targets/x86_64-linux/lib "$wheel"/cu13/lib "$wheel"/cublas/lib \
        "$wheel"/nccl/lib; do
        [ -e "$folder/$library" ] && LD_LIBRARY_PATH=$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} && break
    done
done
export LD_LIBRARY_PATH="${LD_LIBRARY_PATH:+$LD_LIBRARY_PATH:}$here/lib" # libmpi.so looks for its libraries at home only
if [ "$program" = mild ]; then
    program=mild-x86-64-v3
    grep -q avx512vl /proc/cpuinfo && program=mild-x86-64-v4
fi
export PATH="$here/bin:$PATH"
exec "$program" "$@"
RUN
chmod +x "$bundle/run"
du -sh "$bundle"
