# Two commands matter: `make run` (see a robot walk on soft ground, then train one) and `make test`.
JOBS ?= $(shell nproc)
MINUTES ?= 5
RUNS ?= 10000000
TARGETS ?=
CMAKE_FLAGS ?=
PREFIX ?= /usr/local
MARCH ?= native
LAYER ?= task
N ?= 200
SEED ?= 1
MUTANTS ?=
FAULTS ?=
STAGES ?=
MUJOCO_ROOT ?=
QUICK ?=
ARCHS ?=
VERSION ?=
PYTHON312 ?= python3.12
TEST ?=
PYTHONS ?=

.PHONY: setup build quick test nightly run bench install plugin plugin-check deb docs site paper web web-test wheel wheels wheel-cuda python-check mjlab-check newton-check isaaclab-check jax-check dds-check notebook-check check export-check fuzz mutants clean help

help:
	@echo "make run     set up, build, watch the shipped policy walk, train one for MINUTES=$(MINUTES), compare the two"
	@echo "make quick   the tests of ground, task, learn, plugin and one walk, and what they need"
	@echo "make test    set up, build, run the tests of the core"
	@echo "make check   format, clang-tidy, sanitizers, aarch64, wheel, site (STAGES=format: that one)"
	@echo "make nightly all other tests, and the long stages of check"
	@echo "make build   set up, build build/mild"
	@echo "make bench   set up, build, measure speed and memory"
	@echo "make install libmild alone into PREFIX=$(PREFIX), for MARCH=$(MARCH) (x86-64-v3: for other machines too)"
	@echo "make plugin  the MuJoCo plugin into PREFIX, for MUJOCO_ROOT= (docs/plugin.md)"
	@echo "make plugin-check  a wheel beside every MuJoCo that it supports; VERSION=3.3.7: the plugin built for that one (network)"
	@echo "make export-check  what mild export --onnx writes, in ONNX Runtime (installs it into build/onnxruntime)"
	@echo "make fuzz    RUNS=$(RUNS) random inputs for everything that reads (clang; 2 to 25 minutes a target, an hour for model)"
	@echo "make mutants N=$(N) random faults in src/LAYER=$(LAYER): how many do its tests catch? (docs/testing.md)"
	@echo "make mutants FAULTS=1  the named faults of tests/faults.txt: all must be caught"
	@echo "make paper   the paper's experiments as one page, out/paper/index.html (lab/paper/README.md); QUICK=1: few trials, shipped weights"
	@echo "make web     the walk in a browser, build/web, for \`build/mild web\` or any static host (docs/web.md)"
	@echo "make web-test   ten seconds of it in headless Chromium"
	@echo "make docs    libmild's interface as one page, build/api.md, from the headers"
	@echo "make deb     the program and libmild as a Debian package, build/deb/mild_*.deb; TEST=1: tried in a bare chroot"
	@echo "make site    all documentation as a site with search and the page of the arena, build/site/index.html, with its links checked"
	@echo "make wheels  the Python package with the program as one wheel, build/dist, tried in bare environments (PYTHONS=FILES: of these interpreters);"
	@echo "             TEST=1: in a bare Debian 12 too; TEST=\"trixie forky\": in others"
	@echo "make wheel-cuda  the compiled files for GPUs as a wheel beside it, for ARCHS=90 or for all"
	@echo "make wheel   the same in half the time: untried, for MARCH=x86-64-v3 alone unless given"
	@echo "make python-check  its tests with PyTorch, rsl_rl and Stable-Baselines3 (2 GB), in build/learners-venv"
	@echo "make mjlab-check   the package under mjlab, on the CPU (5 GB), in build/mjlab-venv"
	@echo "make newton-check  the ground in MuJoCo Warp and Newton beside the engine plugin, on the CPU, in build/newton-venv"
	@echo "make isaaclab-check  the ground in Isaac Lab 3's own G1 task without its simulator, on the CPU (8 GB), for PYTHON312=python3.12"
	@echo "make jax-check   the batch ground inside jax.jit, and under MJX's robots, in build/jax-venv"
	@echo "make dds-check   lab/drive/examples: robots walk by Unitree's and by ROS 2's messages over DDS, in build/dds-venv"
	@echo "make notebook-check  the notebook of each tutorial in Jupyter's kernel, in build/notebooks-venv"
	@echo "make setup   install what is missing (Debian packages, private Python environment .venv)"
	@echo "make clean   remove build/"

setup:
	@scripts/setup.sh

build: setup
	@cmake -S . -B build -DCMAKE_BUILD_TYPE=Release -DMILD_LAB=ON --log-level=WARNING $(CMAKE_FLAGS)
	@cmake --build build --parallel $(JOBS)

# The program alone; tests, plugin and Python module come with `build`, and take longer than it. VERBOSE=1 shows the compiler.
.PHONY: program
program: setup
	@scripts/quietly.sh build/log/configure.log "configuring the build" \
		cmake -S . -B build -DCMAKE_BUILD_TYPE=Release -DMILD_LAB=ON --log-level=WARNING $(CMAKE_FLAGS)
	@scripts/quietly.sh build/log/compile.log "building build/mild" cmake --build build --parallel $(JOBS) --target mild

# Lanes of tests (docs/testing.md).
ctest = ctest --test-dir build --output-on-failure --parallel $$(($(JOBS) + 1)) --timeout 280 -LE '^(lab|nightly)$$'
core = ground task learn plugin

quick: setup
	@cmake -S . -B build -DCMAKE_BUILD_TYPE=Release --log-level=WARNING $(CMAKE_FLAGS)
	@cmake --build build --parallel $(JOBS) --target mild mild_plugin app_test_play $(core:%=%_tests)
	@$(ctest) -R '^($(subst $() ,|,$(core)))/|^app/test_play'

test: build
	@$(ctest)

# Own builds, under build/check. Installs the tools it needs, which `make test` does without.
check:
	@scripts/setup.sh check
	@JOBS=$(JOBS) scripts/check.sh $(STAGES)

nightly:
	@$(MAKE) --no-print-directory check STAGES="$(or $(STAGES),long analyzer sanitize_all thread vectors notebooks recipes)"

plugin-check: build
	@if [ -n "$(VERSION)" ]; then tests/plugin/test_version.sh "$(VERSION)" build; else $(MAKE) --no-print-directory wheel && \
		scripts/headers.py --check && tests/plugin/test_wheel.sh build/dist/mildground-*.whl build; fi

export-check: build
	@.venv/bin/python -m venv build/onnxruntime
	@build/onnxruntime/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r tests/export/requirements.txt
	@RUNTIME=1 tests/export/test_export.sh build/mild $(CURDIR)/build/onnxruntime/bin/python ON

run: program
	@MINUTES=$(MINUTES) scripts/run.sh

bench: program
	@build/mild bench

# The library needs no setup; its own folder, so that a program that runs from build/ is left alone.
install:
	@cmake -S . -B build/library -DCMAKE_BUILD_TYPE=Release --log-level=WARNING -DMILD_APP=OFF -DMILD_TESTS=OFF \
		-DMILD_MARCH=$(MARCH) -DCMAKE_INSTALL_PREFIX=$(PREFIX) $(CMAKE_FLAGS)
	@cmake --build build/library --parallel $(JOBS) --target mild_shared mild_static mild_batch_shared mild_batch_static
	@cmake --install build/library

# For the MuJoCo of .venv, or for any other, which needs no setup. MUJOCO_ROOT: docs/plugin.md.
plugin: $(if $(MUJOCO_ROOT),,setup)
	@cmake -S . -B build/mujoco -DCMAKE_BUILD_TYPE=Release --log-level=WARNING -DMILD_APP=OFF -DMILD_TESTS=OFF \
		-DMILD_PLUGIN=ON -DMILD_MARCH=$(MARCH) -DMUJOCO_ROOT=$(MUJOCO_ROOT) -DCMAKE_INSTALL_PREFIX=$(PREFIX) $(CMAKE_FLAGS)
	@cmake --build build/mujoco --parallel $(JOBS) --target mild_plugin
	@cmake --install build/mujoco --component plugin

# Set up as for a build; not `build` itself, for it has a folder and a compiler of its own.
fuzz: setup
	@RUNS=$(RUNS) scripts/fuzz.sh $(TARGETS)

# Makes its own builds; MUTANTS: further options (scripts/mutants.py --help).
mutants: setup
	@scripts/mutants.py --layer $(LAYER) -n $(N) --seed $(SEED) --jobs $(JOBS) $(if $(FAULTS),--faults) $(MUTANTS)

# Trains only where there is a GPU (a build with CMAKE_FLAGS=-DMILD_CUDA=ON); keeps what runs/paper has. QUICK: the shipped weights.
paper: build
	@.venv/bin/pip install -q --require-hashes -r lab/paper/requirements.txt
	@$(if $(QUICK),:,if nvidia-smi >/dev/null 2>&1; then lab/paper/train.sh runs/paper; fi)
	@.venv/bin/python lab/paper/paper.py $(if $(QUICK),--trials 3 --models policies/paper)

# With the program, which serves it. emscripten and, for the test, Chromium: large, so nothing else installs them.
web: program
	@scripts/setup.sh web
	@scripts/web.sh

web-test: web
	@node tests/web/test_page.mjs .
	@scripts/web_test.py

docs:
	@mkdir -p build
	@scripts/api.py include/mild/*.h >build/api.md
	@echo build/api.md

# Its own build, for any x86 with AVX2; TEST=1 needs root (debootstrap).
deb: setup
	@JOBS=$(JOBS) scripts/deb.sh $(if $(TEST),test)

# $(call environment,NAME,PYTHON): build/NAME-venv with what NAME.txt of scripts or lab lists, by uv, which is faster than pip by minutes.
listed = $(wildcard scripts/$(1).txt lab/*/$(1).txt)
environment = cmp -s $(listed) build/$(1)-venv/installed || { $(or $(2),python3) -m venv --clear build/$(1)-venv && \
	build/$(1)-venv/bin/pip install -q --disable-pip-version-check --require-hashes -r scripts/uv.txt && \
	build/$(1)-venv/bin/uv pip install -q --python build/$(1)-venv/bin/python --require-hashes -r $(listed) && \
	cp $(listed) build/$(1)-venv/installed; }
# $(call with_wheel,NAME,PYTHON): the same with the wheel, as a user has it.
with_wheel = $(call environment,$(1),$(2)) && \
	build/$(1)-venv/bin/pip install -q --disable-pip-version-check --no-deps --force-reinstall build/dist/mildground-*.whl

# By pip, as `make setup`: a part of `make check`.
site:
	@cmp -s scripts/site.txt build/site-venv/installed || { python3 -m venv --clear build/site-venv && \
		build/site-venv/bin/pip install -q --disable-pip-version-check --require-hashes -r scripts/site.txt && \
		cp scripts/site.txt build/site-venv/installed; }
	@build/site-venv/bin/python scripts/site.py build/site
	@echo build/site/index.html

wheel: setup
	@MARCH=$(MARCH) scripts/wheels.sh --plain --untried

# Its own compiler, from the package index (2 GB).
wheel-cuda: setup
	@ARCHS="$(ARCHS)" scripts/wheel_cuda.sh

wheels: setup
	@MARCH=$(MARCH) scripts/wheels.sh $(PYTHONS)
	@$(if $(TEST),scripts/wheels.sh build/dist/mildground-*.whl --chroot $(patsubst 1,bookworm,$(TEST)))

python-check: wheel
	@$(call with_wheel,learners)
	@build/learners-venv/bin/python tests/python/check_learners.py
	@build/learners-venv/bin/python tests/python/check_ppo.py
	@build/learners-venv/bin/python tests/python/test_gradients.py
	@build/learners-venv/bin/python lab/paper/tests/test_learners.py .
	@build/learners-venv/bin/python tests/python/check_cuda.py

mjlab-check: wheel
	@$(call with_wheel,mjlab)
	@build/mjlab-venv/bin/python -W ignore tests/python/check_mjlab.py

newton-check: wheel
	@$(call with_wheel,newton)
	@build/newton-venv/bin/python -W ignore tests/python/check_newton.py

isaaclab-check: wheel
	@$(call with_wheel,isaaclab,$(PYTHON312))
	@build/isaaclab-venv/bin/python -W ignore tests/python/check_isaaclab.py

jax-check: wheel
	@$(call with_wheel,jax)
	@build/jax-venv/bin/python -W ignore tests/python/check_jax.py
	@build/jax-venv/bin/python tests/python/test_gradients.py

# The bridges of lab/drive.
dds-check: build
	@$(call environment,dds)
	@PYTHONPATH=build/python build/dds-venv/bin/python lab/drive/tests/test_unitree.py build/mild
	@PYTHONPATH=build/python build/dds-venv/bin/python lab/drive/tests/test_ros2.py build/mild

# As a user has them: from the wheel. The notebooks with their pictures stay in build/notebooks.
notebook-check: wheel
	@$(call with_wheel,notebooks)
	@build/notebooks-venv/bin/python tests/install/check_notebooks.py . build/notebooks

clean:
	rm -rf build
