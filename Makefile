# What one can do here. `make demo` and `make test` set up all they need: only Rust and Python >= 3.10 are assumed.
#
#   make demo       no hardware: an emulated rig hides an effect, is balanced, logged, diagnosed and repaired; a report
#   make test       every test, Rust and Python, but the long ones
#   make test-long  those that take a minute or more each
#   make test-clusters  campaigns on Ray and Dask clusters, one worker killed; installs both
#   make lint       formatting, clippy, crates for the microcontroller, documentation: warnings are errors; licences
#   make fuzz       every fuzz target for SECONDS (60); installs cargo-fuzz
#   make py         the Python package `furuta`, into .venv
#   make wheel      wheels (x86-64, aarch64) and an sdist, into dist/; tries them in empty environments
#   make docs       site/index.html (guides, Python reference, effects), target/doc/furuta_model/index.html, figures
#   make site       site/index.html alone; its warnings are errors
#   make figures    every figure in docs that a command of this program draws
#   make bench      benchmarks (criterion)
#   make bench-peers  speed beside other packages, in one process: writes docs/benchmarks.md
#   make no-std     the crates without an operating system, for a Cortex-M4F
#   make firmware   builds the programs for the microcontroller; checks that no control step can panic
#   make firmware-run   runs them in QEMU, `furuta run` against the board's serial line included: docs/firmware.md
#   make firmware-cost  prints what they cost: flash, RAM, stack, instructions
#   make arduino    builds the sketch for an Arduino, runs `furuta run` against it in simavr: docs/arduino.md
#   make same-bits  runs the model here and on a Cortex-M4 in QEMU and compares every bit: docs/target.md
#   make clean      removes what was built, .venv and .venv-docs included

SHELL := /bin/bash -eu -o pipefail
.DEFAULT_GOAL := help
CARGO ?= cargo
# The first Python that is new enough; `make PYTHON=/path/to/python test` decides otherwise.
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11 python3.10; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null && { echo $$p; break; }; done)
VENV := .venv
VENV_DOCS := .venv-docs
VENV_WHEEL := .venv-wheel
VENV_PEERS := .venv-peers
# PyO3 asks this interpreter for its version; one answer for every build, or cargo builds it again each time.
export PYO3_PYTHON := $(CURDIR)/$(VENV)/bin/python
# Each crate is compiled in a few large pieces, as nothing is built twice here: an incremental build cuts it into many
# small ones, whose code runs for longer.
export CARGO_INCREMENTAL ?= 0
# Where the Python tests find the command-line program (as maturin and cargo do, this honours CARGO_TARGET_DIR).
TARGET := $(or $(CARGO_TARGET_DIR),$(CURDIR)/target)
# The machine at hand, as cargo calls it: in firmware/ the microcontroller is what is built for.
HOST = $(shell rustc -vV | sed -n 's/^host: //p')

.PHONY: help demo build test test-rust test-python test-long test-clusters lint fmt no-std firmware firmware-run firmware-cost \
	arduino same-bits fuzz docs site figures bench bench-peers py wheel clean

help:
	@sed -n 's/^#   //p' Makefile

build:
	$(CARGO) build --release --locked

# Cargo's line of progress, also where no terminal is: how many of how many packages are built.
demo: export CARGO_TERM_PROGRESS_WHEN := always
demo: export CARGO_TERM_PROGRESS_WIDTH := 100
demo:
	@test -x $(TARGET)/release/furuta || echo "make demo: building the command, once: some minutes; the demo itself takes one"
	$(CARGO) build --release --locked
	$(TARGET)/release/furuta demo

test: test-rust test-python

# The Python extension cannot be linked into a Rust test; it is tested from Python. It is among the packages here so that
# they are built with the features that it asks for, and once.
test-rust:
	$(CARGO) test --workspace --locked --no-fail-fast

# The package as the Rust tests have it: nothing is built twice, and overflow is caught. What is released is tried by
# `make wheel` and the long tests. The command line is tested as the package carries it; the package, as a wheel in an
# empty environment too. Files of tests run side by side, one on each core: most of what they start waits, or counts on
# one core.
test-python: $(VENV)/ready
	VIRTUAL_ENV=$(CURDIR)/$(VENV) $(VENV)/bin/maturin develop --locked --quiet
	FURUTA_CLI=$(CURDIR)/$(VENV)/bin/furuta $(VENV)/bin/python -m pytest -n auto --dist loadfile
	rm -rf $(TARGET)/tried
	$(VENV)/bin/maturin build --locked --quiet --compatibility linux --interpreter $(VENV)/bin/python --out $(TARGET)/tried
	$(VENV)/bin/python py/tests/wheel.py $(TARGET)/tried/furuta-*.whl

test-long: py
	$(CARGO) test -p furuta-ident --locked --test ident -- --ignored
	FURUTA_CLI=$(CURDIR)/$(VENV)/bin/furuta $(VENV)/bin/python -m pytest -m long

test-clusters: py
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r py/requirements-clusters.txt
	$(VENV)/bin/python -m pytest py/tests/test_campaign_clusters.py

# A virtual environment (first word) with what a file lists (second); it is made anew when the list changes.
define environment
$(1)/ready: $(2)
	@test -n "$$(PYTHON)" || { \
		echo "no Python 3.10 or newer found: install one, or say make PYTHON=/path/to/python"; exit 1; }
	rm -rf $(1)
	$$(PYTHON) -m venv $(1) || { \
		echo "this Python has no venv module (Debian, Ubuntu: apt install python3-venv)"; rm -rf $(1); exit 1; }
	$(1)/bin/python -m pip install --quiet --disable-pip-version-check -r $(2)
	touch $$@
endef
$(eval $(call environment,$(VENV),py/requirements-test.txt))
$(eval $(call environment,$(VENV_DOCS),py/requirements-docs.txt))
$(eval $(call environment,$(VENV_WHEEL),py/requirements-wheel.txt))
$(eval $(call environment,$(VENV_PEERS),py/requirements-peers.txt))

py: $(VENV)/ready
	VIRTUAL_ENV=$(CURDIR)/$(VENV) $(VENV)/bin/maturin develop --release --locked --quiet

# For every Linux of the last ten years: zig links against its C library. Of two machines this one's is tried, and the
# sdist, which is built again where it is installed.
MANYLINUX := manylinux2014
wheel: $(VENV_WHEEL)/ready
	rustup target add x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu
	rm -rf dist
	for machine in x86_64 aarch64; do \
		PATH="$(CURDIR)/$(VENV_WHEEL)/bin:$$PATH" maturin build --release --locked --strip --zig --out dist \
			--compatibility $(MANYLINUX) --target $$machine-unknown-linux-gnu --interpreter python3; done
	$(VENV_WHEEL)/bin/maturin sdist --out dist
	$(VENV_WHEEL)/bin/python py/tests/wheel.py dist/furuta-*_$$(uname -m).whl dist/furuta-*.tar.gz
	$(CARGO) publish --workspace --dry-run --no-verify --locked --allow-dirty

lint: $(VENV)/ready no-std
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --no-deps --locked
	$(CARGO) deny --version >/dev/null 2>&1 || $(CARGO) install cargo-deny --locked --no-default-features --quiet --debug
	$(CARGO) deny --workspace check licenses bans sources
	cd firmware && $(CARGO) fmt --all --check
	cd firmware && CARGO_TARGET_DIR=$(TARGET) \
		$(CARGO) clippy --workspace --all-targets --locked --target $(HOST) -- -D warnings
	cd firmware && CARGO_TARGET_DIR=$(TARGET) bash ../.ci/for-target clippy --workspace --locked -- -D warnings

fmt:
	$(CARGO) fmt --all
	cd firmware && $(CARGO) fmt --all

no-std:
	bash .ci/no-std

firmware:
	CARGO_TARGET_DIR=$(TARGET) bash .ci/firmware build

firmware-run:
	CARGO_TARGET_DIR=$(TARGET) bash .ci/firmware run

firmware-cost:
	CARGO_TARGET_DIR=$(TARGET) bash .ci/firmware cost

arduino:
	CARGO_TARGET_DIR=$(TARGET) bash .ci/arduino run

same-bits:
	CARGO_TARGET_DIR=$(TARGET) bash .ci/same-bits

# How long each target is fuzzed, s.
SECONDS ?= 60
fuzz:
	CARGO_TARGET_DIR=$(TARGET) bash .ci/fuzz $(SECONDS)

docs: $(VENV)/ready figures site
	$(CARGO) doc --workspace --no-deps --locked

# The package is looked at where `make py` builds it: the reference and the pictures of the effects come from it.
site: py $(VENV_DOCS)/ready
	NO_MKDOCS_2_WARNING=1 PYTHONPATH=py/python $(VENV_DOCS)/bin/mkdocs build --strict --quiet

FURUTA = $(TARGET)/release/furuta
# The pages whose code draws their figures.
PAGES = docs/tour.md docs/paper-fong2014.md docs/paper-shahzad2022.md docs/paper-ramos-velasco.md
figures: build py
	$(FURUTA) study fong2014 --plot docs/fong2014.svg
	$(FURUTA) identify compare --published fong2014 --rig fong2014-emecs --plot docs/fong2014-compare.svg
	$(FURUTA) study shahzad2022 --task step --plot docs/shahzad2022-step.svg
	$(FURUTA) study shahzad2022 --task steps --plot docs/shahzad2022-steps.svg
	$(FURUTA) study shahzad2022 --task push --plot docs/shahzad2022-push.svg
	$(FURUTA) study mpc --plot docs/mpc.svg
	$(FURUTA) study ramos-velasco --plot docs/ramos-velasco-planar.svg
	$(FURUTA) study ramos-velasco --on full --plot docs/ramos-velasco-full.svg
	$(FURUTA) study ramos-velasco --on rig --plot docs/ramos-velasco-rig.svg
	$(FURUTA) study swing-up --plot docs/swing-up.svg
	$(FURUTA) study limit-cycle --rig qube-servo-2 --hide arm.coulomb --plot docs/limit-cycle.svg
	$(FURUTA) study region --plot docs/region.svg
	FURUTA_CLI=$(FURUTA) $(VENV)/bin/python py/tests/pages.py --pictures $(PAGES)

bench:
	$(CARGO) bench -p furuta-benches --locked

# Two that not every machine can install, or build, are left out where they fail: slycot needs a Fortran compiler where
# there is no wheel, TinyMPC asks for a NumPy older than the others' (and works without).
bench-peers: py $(VENV_PEERS)/ready
	for package in slycot==0.7.1 "--no-deps tinympc==0.0.8"; do \
		$(VENV_PEERS)/bin/python -m pip install --quiet --disable-pip-version-check $$package \
		|| echo "left out: $$package"; done
	PYTHONPATH=py/python $(VENV_PEERS)/bin/python py/bench --write docs/benchmarks.md

clean:
	$(CARGO) clean
	rm -rf $(VENV) $(VENV_DOCS) $(VENV_WHEEL) $(VENV_PEERS) dist site
