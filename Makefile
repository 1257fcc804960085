# Front door. `make demo` and `make test` work on a fresh machine; everything else is below.
SHELL := bash
PRESET ?= release
BUILD := build/$(PRESET)
JOBS ?= $(shell nproc)
YGSLAM_SHARED ?= $(abspath ../shared)
export YGSLAM_SHARED

.PHONY: help setup configure build demo test bench model quantize format lint clean
help: ## this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /\t/' | expand -t 12

setup: .venv/.ready ## install Debian packages (with sudo if not root) and the Python environment

.venv/.ready: tools/setup.sh tools/requirements.txt
	tools/setup.sh
	@touch $@

configure: .venv/.ready
	@[ -f $(BUILD)/build.ninja ] || cmake --preset $(PRESET)

build: configure ## build library, command line, tests and benchmarks
	@cmake --build $(BUILD) -j $(JOBS)

demo: configure ## run the main job; SEQ=folder MODEL=file.onnx OUT=folder
	@cmake --build $(BUILD) -j $(JOBS) --target ygslam_cli
	@tools/demo.sh $(BUILD)/ygslam "$(SEQ)" "$(MODEL)" "$(or $(OUT),out/demo)"

test: build ## build and run all tests
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

bench: configure ## run the benchmarks
	@cmake --build $(BUILD) -j $(JOBS)
	@tools/bench.sh $(BUILD)

model: ## export YOLOv8n-seg to models/ (needs the public internet; WEIGHTS=file.pt|untrained)
	@python3 tools/export_model.py --out models $(if $(WEIGHTS),--weights $(WEIGHTS))

quantize: ## write an int8 model beside MODEL, calibrated on IMAGES=folder
	@python3 tools/quantize_model.py --model $(or $(MODEL),models/yolov8n-seg_480x640.onnx) --images "$(IMAGES)"

format: ## format all sources
	@git ls-files 'src/*.[ch]pp' 'bench/*.cpp' 'tests/*.cpp' 'include/*.hpp' 'examples/*.cpp' | xargs clang-format -i

lint: configure ## check formatting and run clang-tidy
	@git ls-files 'src/*.[ch]pp' 'bench/*.cpp' 'tests/*.cpp' 'include/*.hpp' 'examples/*.cpp' | xargs clang-format --dry-run -Werror
	@git ls-files 'src/*.cpp' | grep -v _test | xargs -P $(JOBS) -n 4 clang-tidy -p $(BUILD) --quiet

clean: ## remove what was built
	rm -rf build
