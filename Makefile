# Front door. `make demo` and `make test` work on a fresh machine; everything else is below.
SHELL := bash
PRESET ?= release
BUILD := build/$(PRESET)
JOBS ?= $(shell nproc)
YGSLAM_SHARED ?= $(abspath ../shared)
export YGSLAM_SHARED
space := $(subst ,, )

SOURCES = git ls-files --cached --others --exclude-standard \
  'src/*.[ch]pp' 'fuzz/*.[ch]pp' 'bench/*.[ch]pp' 'tools/*.cpp' 'include/*.hpp' 'examples/*.cpp' 'ros2/*.cpp' \
  'tests/*.[ch]pp'

.PHONY: help setup setup-checks setup-nightly configure configure-program build demo test arm64 nightly bench wheel model \
  quantize train format check-format lint sanitize clean
help: ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 14

setup: .venv/.ready ## install all that program, report, tests and tools need: Debian packages (with sudo if not root), .venv

.venv/.ready: .venv/.program-ready tools/requirements-tools.txt
	tools/setup.sh
	@touch $@

.venv/.program-ready: tools/setup.sh tools/requirements.txt
	tools/setup.sh program
	@touch $@

setup-checks: setup ## install what `make check-format`, `make lint` and some tests need
	@tools/setup.sh checks

setup-nightly: setup-checks ## install what the tests of `make nightly` need: Chromium, mmdebstrap, Rerun
	@tools/setup.sh nightly

configure: setup
	@grep -qs '^YGSLAM_BUILD_TESTS:BOOL=ON' $(BUILD)/CMakeCache.txt || cmake --preset $(PRESET)

# Without tests: nothing that only they need has to be there.
configure-program: .venv/.program-ready
	@[ -f $(BUILD)/build.ninja ] || cmake --preset $(PRESET) \
	  -DYGSLAM_BUILD_TESTS=OFF -DYGSLAM_BUILD_BENCH=OFF -DYGSLAM_PYTHON_MODULE=OFF

build: configure ## build library, command line and tests
	@cmake --build $(BUILD) -j $(JOBS)

demo: configure-program ## run the main job; SEQ=folder MODEL=file.onnx OUT=folder
	@cmake --build $(BUILD) -j $(JOBS) --target ygslam_cli
	@tools/demo.sh $(BUILD)/ygslam "$(SEQ)" "$(MODEL)" "$(or $(OUT),out/demo)"

test: build ## build and run the tests of every change; the others wait for `make nightly`
	@tools/run_tests.sh $(BUILD) -j $(JOBS) -LE nightly

# A network of YOLO's size takes minutes for an image under QEMU.
ARM64_TESTS := core image geometry features optim segment motion tracking
arm64: build ## program, package and wheel for 64-bit ARM into dist/; tests under QEMU, beside this machine's program
	@tools/setup.sh arm64
	@cmake --preset arm64 >/dev/null
	@cmake --build build/arm64 -j $(JOBS) --target ygslam_cli ygslam_library $(ARM64_TESTS:%=%_test)
	@tools/arm64_package.sh dist
	@.venv/bin/pip install --quiet --disable-pip-version-check -r tools/requirements-wheel.txt
	@.venv/bin/python tools/wheel.py --arm64
	@YGSLAM_EMULATED=1 tools/run_tests.sh build/arm64 -j $(JOBS) -L '^($(subst $(space),|,$(ARM64_TESTS)))$$' -E TrainedYolo
	@.venv/bin/python tests/arm64_test.py --reference $(BUILD)/ygslam -v

nightly: setup-nightly check-format ## everything: all tests, linter and sanitizers on all code; what a release needs
	@$(MAKE) build PRESET=ci
	@$(MAKE) wheel
	@tools/run_tests.sh build/ci -j $(JOBS)
	@if tools/setup.sh arm64; then $(MAKE) arm64 PRESET=ci; else \
	  echo "SKIPPED: nothing was built or tested for 64-bit ARM, its compiler or libraries cannot be installed here"; fi
	@$(MAKE) lint sanitize ALL=1

bench: configure ## build and run the benchmarks, and a run stage by stage; SEQ="folder ..."
	@cmake --build $(BUILD) -j $(JOBS) --target bench/all
	@tools/bench.sh $(BUILD) $(SEQ)

wheel: setup ## Python wheels in dist/ that install without a compiler, one for each CPython that needs its own
	@.venv/bin/pip install --quiet --disable-pip-version-check -r tools/requirements-wheel.txt
	@.venv/bin/python tools/wheel.py

model: ## export YOLOv8n-seg, or NETWORK=name, to models/ (needs the public internet; WEIGHTS=file|untrained)
	@python3 tools/export_model.py --out models $(if $(NETWORK),--model $(NETWORK)) $(if $(WEIGHTS),--weights $(WEIGHTS))

quantize: ## write an int8 model beside MODEL, calibrated on IMAGES=folder
	@python3 tools/quantize_model.py --model $(or $(MODEL),models/yolov8n-seg_480x640.onnx) --images "$(IMAGES)"

train: configure-program ## render, train and export the people network; FRAMES=N SAMPLES=N; stop and go on at will
	@cmake --build $(BUILD) -j $(JOBS) --target ygslam_cli
	@python3 training/run.py --ygslam $(BUILD)/ygslam $(if $(FRAMES),--frames $(FRAMES)) $(if $(SAMPLES),--samples $(SAMPLES))

format: ## format all sources
	@$(SOURCES) | xargs clang-format-16 -i

check-format: setup-checks ## fail where `make format` would change something
	@$(SOURCES) | xargs clang-format-16 --dry-run -Werror

# The files of a module are compiled together, so that headers are read once; precompiled headers
# are all that is built.
lint: setup-checks ## clang's warnings and clang-tidy on what changed since .ci/lint_base, or with ALL=1 on all sources
	@cmake --preset clang >/dev/null
	@cmake --build build/clang -j $(JOBS) --target ygslam_precompiled ygslam_precompiled_quick ygslam_precompiled_test \
	  ygslam_precompiled_simulation
	@python3 tools/lint.py build/clang -j $(JOBS) $(if $(ALL),,--since .ci/lint_base) \
	  --record .ci/lint_base

# On a submission the address and undefined behaviour sanitizers see what reads foreign bytes or owns memory,
# the thread sanitizer whatever has threads; with ALL=1 every module. Numeric modules have _GLIBCXX_ASSERTIONS
# in the tests of `ci`.
ASAN_TESTS := core image io bag live_requests scene_file segment volume map map_file
ASAN_TESTS_ALL := $(ASAN_TESTS) live geometry scene scene_picture features optim motion mapping loop tracking dense facade inertial
asan_tests = $(if $(ALL),$(ASAN_TESTS_ALL),$(ASAN_TESTS))
TSAN_TESTS := ^(core\.(BoundedQueue|Published|Trace)|io\.(FrameReader|TraceWriter)|(facade|system)_threads\.)
sanitize: setup ## unit tests under address, undefined behaviour and thread sanitizers; ALL=1: of every module
	@cmake --preset asan >/dev/null && cmake --preset tsan >/dev/null
	@cmake --build build/asan -j $(JOBS) --target $(asan_tests:%=%_test)
	@ctest --preset asan -j $(JOBS) -L '^($(subst $(space),|,$(asan_tests)))$$'
	@cmake --build build/tsan -j $(JOBS) --target core_test io_test facade_threads_test system_threads_test
	@ctest --preset tsan -j $(JOBS) -R '$(TSAN_TESTS)'

clean: ## remove what was built
	rm -rf build
