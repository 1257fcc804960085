# Front door. `make demo` and `make test` work on a fresh machine; everything else is below.
SHELL := bash
PRESET ?= release
BUILD := build/$(PRESET)
JOBS ?= $(shell nproc)
YGSLAM_SHARED ?= $(abspath ../shared)
export YGSLAM_SHARED

SOURCES = git ls-files --cached --others --exclude-standard \
  'src/*.[ch]pp' 'fuzz/*.[ch]pp' 'bench/*.[ch]pp' 'tools/*.cpp' 'include/*.hpp' 'examples/*.cpp' 'ros2/*.cpp' \
  'tests/*.[ch]pp'

.PHONY: help setup setup-checks configure configure-program build demo test bench model quantize train \
  format check-format lint sanitize clean
help: ## this list
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 14

setup: .venv/.ready ## install all that program, report, tests and tools need: Debian packages (with sudo if not root), .venv

.venv/.ready: .venv/.program-ready tools/requirements-tools.txt
	tools/setup.sh
	@touch $@

.venv/.program-ready: tools/setup.sh tools/requirements.txt
	tools/setup.sh program
	@touch $@

setup-checks: setup ## install what `make check-format` and `make lint` need
	@tools/setup.sh checks

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

test: build ## build and run all tests
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

bench: configure ## build and run the benchmarks
	@cmake --build $(BUILD) -j $(JOBS) --target bench/all
	@tools/bench.sh $(BUILD)

model: ## export YOLOv8n-seg to models/ (needs the public internet; WEIGHTS=file.pt|untrained)
	@python3 tools/export_model.py --out models $(if $(WEIGHTS),--weights $(WEIGHTS))

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
lint: setup-checks ## clang's warnings and clang-tidy on all sources, any finding is an error
	@cmake --preset clang >/dev/null
	@cmake --build build/clang -j $(JOBS) --target ygslam_precompiled ygslam_precompiled_quick ygslam_precompiled_test \
	  ygslam_precompiled_simulation
	@run-clang-tidy-16 -p build/clang -j $(JOBS) -quiet '/Unity/|_test\.cpp$$'

# Address and undefined behaviour: the unit tests of these modules. Threads: whatever has some.
ASAN_TESTS := core geometry image scene io bag live scene_file scene_picture features segment optim volume map map_file motion mapping loop tracking dense facade
TSAN_TESTS := ^(BoundedQueue|Published|FrameReader|LiveRunner|SegmentInbox|SegmenterFault|AdjustmentThread|DenseThread|MapSaver)
tests_of = $(foreach module,$(1),$(if $(wildcard src/$(module)/*_test.cpp),$(module)_test))
space := $(subst ,, )
sanitize: setup ## unit tests under address, undefined behaviour and thread sanitizers
	@cmake --preset asan >/dev/null && cmake --preset tsan >/dev/null
	@cmake --build build/asan -j $(JOBS) --target $(call tests_of,$(ASAN_TESTS))
	@ctest --preset asan -j $(JOBS) -L '^($(subst $(space),|,$(ASAN_TESTS)))$$'
	@cmake --build build/tsan -j $(JOBS) --target core_test io_test system_test
	@ctest --preset tsan -j $(JOBS) -R '$(TSAN_TESTS)'

clean: ## remove what was built
	rm -rf build
