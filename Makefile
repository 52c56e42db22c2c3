# SPDX-License-Identifier: Apache-2.0
# Every target sets up what it needs first: see scripts/with_ros.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help demo run test test_nightly test_exports lint docs gallery bench clean

PROGRAMS := install/limit_surface_ros/lib/limit_surface_ros
SHARE := install/limit_surface_ros/share/limit_surface_ros
# PYTHON=python3.12 make ... chooses the interpreter; ARGS="..." goes where `make help` says.
ARGS ?=

help: ## Show what can be made
	@echo "limit_surface_ros: make TARGET [ARGS=\"...\"] [PYTHON=python3.12]"
	@awk -F ':.*## ' '/^[a-z_]+:.*## / {printf "  %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: ## Start both nodes, call their services, print tables
	@scripts/with_ros --isolated -- python3 $(PROGRAMS)/demo

run: ## Serve the models of config/ until Ctrl-C (ARGS go to limit_surface_node)
	@scripts/with_ros --foreground -- python3 $(PROGRAMS)/limit_surface_node \
	    --ros-args --params-file $(SHARE)/config/limit_surface.yaml $(ARGS)

test: ## Run the tests against the built packages (ARGS go to pytest: ARGS="-k name")
	@scripts/with_ros --with test --with extras --isolated -- python3 scripts/run_pytest.py $(ARGS)

test_nightly: ## Run the tests that take long, which `make test` leaves out (ARGS go to pytest)
	@scripts/with_ros --with test --with extras --isolated -- python3 scripts/run_pytest.py \
	    -m nightly --timeout 3600 $(ARGS)

test_exports: ## Run the tests of exported models where CasADi, JAX and MuJoCo are (some 500 MB)
	@scripts/with_ros --with test --with extras --with exports -- python3 scripts/run_pytest.py \
	    test/export test/examples/test_example_controllers.py $(ARGS)

lint: ## Check style, types and package descriptions
	@scripts/with_ros --tools lint -- scripts/lint

docs: ## Build the documentation into docs/_build/html
	@scripts/with_ros --with docs -- python3 -m sphinx -W --keep-going -q docs docs/_build/html
	@echo "open docs/_build/html/index.html"

gallery: ## Draw the pictures of the gallery anew (ARGS name some of its contacts)
	@scripts/with_ros --with extras -- python3 examples/gallery/make_gallery.py \
	    docs/images/gallery $(ARGS)

bench: ## Measure against named peers, into benchmarks/RESULTS.md (ARGS name some of them)
	@scripts/with_ros --with bench -- python3 benchmarks/run.py $(ARGS)

clean: ## Remove everything that was installed, built or logged here
	@rm -rf .venv .venv-lint build install log .mypy_cache .ruff_cache .hypothesis
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
	@echo "removed .venv, build, install, log and caches"
