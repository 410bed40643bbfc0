# make demo     the paper's three scenes and their figure
# make check    linters, types, fast tests: within a minute once installed
# make test     all C++ and Python tests, formatters, linters
# make sanitize FMUs, random calls of both, threads and the runtime's C++ tests under ASan + UBSan, then under TSan
# make tidy     clang-tidy (bug patterns, data races, names) over the C++ models and the FMI runtime
# make fmus     fmus/thermal.fmu and fmus/rod.fmu
# make portable both with binaries for Windows as well, and in build/wheel/ a wheel with them, which needs no compiler
# make charts   figures of docs/figures that are measured: convergence, chart_SCENE_PANEL, chart_release (requires the extra
#               peers), stability
# make reference  docs/reference.md: every command, key and variable
# make docs     build/site/index.html: the documentation; warnings are errors, no network at build or view time
# make format   formats everything
# Each sets up what it needs: system packages (on Debian), .venv, the package with its FMUs. WERROR=ON: as CI. pip is
# verbose, or compiling would be minutes of silence.
VENV := .venv
BUILD := build
WERROR ?= OFF
export PATH := $(CURDIR)/$(VENV)/bin:$(PATH)
CXX_FILES := $(shell find fmus thermal_fmu rod_fmu tests -name '*.[ch]pp' -o -name '*.c')
SOURCES := $(CXX_FILES) $(shell find fmus thermal_fmu rod_fmu tests orchestration -name '*.txt' -o -name '*.md' \
	-o -name '*.png' -o -name '*.cmake' -o -name '*.map' -o -path 'orchestration/*' -type f ! -name '*.pyc') CMakeLists.txt pyproject.toml
WINDOWS = TCA_WIN64=ON $(addprefix FETCHCONTENT_SOURCE_DIR_SUNDIALS=,$(realpath $(VENV)/sundials))

.NOTPARALLEL: # one build folder; what runs in it is parallel
.PHONY: sanitize tidy fmus portable demo test charts reference docs lint check compiled format
fmus: $(VENV)/installed

portable: $(BUILD)/wheel/ready

demo: $(VENV)/installed
	tca-cosim paper

compiled: $(VENV)/installed $(VENV)/tested
	cmake -S . -B $(BUILD) -DTCA_BUILD_TESTS=ON >$(BUILD)/configure.log || { cat $(BUILD)/configure.log; false; }
	cmake --build $(BUILD)

charts: compiled
	python tests/bench/charts.py $(BUILD) docs/figures/convergence.png
	python docs/bodies.py
	tca-cosim chart step drop tap --picture docs/figures --workers 2
	tca-cosim chart release --picture docs/figures
	tca-cosim stability step --set rod.dynamic=true --out $(BUILD)/figures
	tca-cosim stability oscillators --out $(BUILD)/figures
	cp $(BUILD)/figures/step.stability.png docs/figures/stability.png
	cp $(BUILD)/figures/oscillators.stability.png docs/figures/stability_oscillators.png

$(BUILD)/hosts/ready: .ci/hosts tests/hosts/pom.xml $(VENV)/tested
	.ci/hosts $(BUILD)/hosts python
	touch $@

$(BUILD)/wheel/ready: $(VENV)/installed $(VENV)/windows
	rm -rf $(BUILD)/wheel
	python -m pip wheel --verbose --no-deps --no-build-isolation -Cbuild-dir=$(BUILD) $(addprefix -Ccmake.define.,$(WINDOWS)) \
		-Cwheel.tags=py3-none-manylinux2014_x86_64 --wheel-dir $(BUILD)/wheel .
	touch $@

lint:
	ruff check .
	ruff format --check .
	python -m mypy
	clang-format --dry-run --Werror $(CXX_FILES)

check: $(VENV)/installed $(VENV)/tested
	$(MAKE) --no-print-directory lint
	python -m pytest -q -m "not slow and not hosts" -n auto

test: portable compiled $(BUILD)/hosts/ready
	$(MAKE) --no-print-directory lint
	ctest --test-dir $(BUILD) --output-on-failure
	$(MAKE) --no-print-directory sanitized-address,undefined SANITIZED="probe thermal"
	python -m pytest --cov -n auto

reference: $(VENV)/installed
	PYTHONPATH=. python docs/reference.py

docs: $(VENV)/installed
	python -m sphinx -q -W --keep-going -b html docs $(BUILD)/site

# FMUs, and what drives them through their binaries, under sanitizers. Nothing is optimised, which would take longer.
SANITIZED := probe thermal rod
EMPTY :=
sanitized-%: $(VENV)/tested
	cmake -S . -B $(BUILD)/sanitize-$* -G Ninja -DTCA_BUILD_TESTS=ON -DTCA_SANITIZE=$* -DCMAKE_BUILD_TYPE=None
	cmake --build $(BUILD)/sanitize-$* --target contract drive cycle $(addsuffix _pack,$(SANITIZED))
	ctest --test-dir $(BUILD)/sanitize-$* -R '^(contract|drive|cycle)_($(subst $(EMPTY) $(EMPTY),|,$(SANITIZED)))$$' \
	  -j 2 --output-on-failure

# All three under both kinds, 64 instances in threads, and the C++ tests of the runtime.
sanitize: sanitized-address,undefined sanitized-thread
	for kind in address,undefined thread; do \
	  cmake --build $(BUILD)/sanitize-$$kind --target test_fmus && \
	  $(BUILD)/sanitize-$$kind/tests/test_fmus && \
	  ctest --test-dir $(BUILD)/sanitize-$$kind -R '^threads_' --output-on-failure || exit 1; \
	done

tidy: $(VENV)/tested
	cmake -S . -B $(BUILD)/tidy -G Ninja -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
	clang-tidy -p $(BUILD)/tidy --quiet --extra-arg=-Wno-unknown-warning-option $(filter-out %unload.cpp,$(filter %.cpp,$(shell find fmus thermal_fmu rod_fmu -name '*.cpp')))

format: $(VENV)/installed $(VENV)/tested
	ruff check --fix .
	ruff format .
	clang-format -i $(CXX_FILES)

$(VENV)/ready: .ci/setup
	.ci/setup $(VENV)
	touch $@

$(VENV)/tested: .ci/setup $(VENV)/ready
	.ci/setup $(VENV) tests
	touch $@

$(VENV)/windows: .ci/setup .ci/sundials $(VENV)/ready
	.ci/setup $(VENV) windows
	.ci/sundials $(VENV)/sundials
	touch $@

$(VENV)/installed: $(VENV)/ready $(SOURCES)
	python -m pip install --verbose --no-build-isolation -Cbuild-dir=$(BUILD) \
		-Ccmake.define.TCA_FMU_DIR=$(CURDIR)/fmus -Ccmake.define.TCA_WERROR=$(WERROR) '.[test]'
	touch $@
