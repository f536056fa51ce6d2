# A virtual environment of its own: one with the ROS 2 wheels, one for each release that ROS names
# (make test ROS=kilted), or one for each sourced ROS 2.
export PYTHON ?= python3
export ROS ?=
SOURCED := $(shell [ -n "$$ROS_DISTRO" ] && $(PYTHON) -c 'import rclpy' 2>/dev/null && echo -$$ROS_DISTRO)
VENV := .venv$(if $(ROS),-wheels-$(ROS),$(SOURCED))
READY := $(VENV)/ready
PY := $(VENV)/bin/python
PYTEST_ARGS ?=
CAMPAIGN_ARGS ?=
# One process for the tests that start nodes, one for the others.
WORKERS := -n 2 --dist loadgroup --no-loadscope-reorder

.PHONY: help set-up demo test trials campaign quick lint bench clean

help:
	@echo 'make demo    set everything up, then run the saw-tooth test on the old and the new'
	@echo '             circuit in five ROS 2 processes; results in out/demo'
	@echo 'make test    the whole suite with the linters and mypy; PYTEST_ARGS="-k backlash"'
	@echo '             runs a part, ROS=kilted the wheels of that ROS 2 release'
	@echo 'make trials  what make test leaves out because it takes minutes'
	@echo 'make campaign  look for faults for some hours; resumable; results in out/campaign.'
	@echo '             CAMPAIGN_ARGS="--dose medium" takes half an hour, --short ten minutes'
	@echo 'make quick   the suite without what takes more than a few seconds'
	@echo 'make lint    the linters and mypy alone'
	@echo 'make bench   measure speed'
	@echo 'make set-up  only set up: $(VENV), see scripts/set-up'
	@echo 'make clean   remove $(VENV) and everything built or written here'
	@echo
	@echo 'Needs Python 3.10 or newer. Uses the ROS 2 of the shell where one is sourced, else the'
	@echo 'ROS 2 wheels (x86-64 Linux). By hand: . $(VENV)/bin/activate; antenna-drive --help'

set-up: $(READY)

$(READY): setup.py lab/pyproject.toml setup.cfg pyproject.toml antenna_drive/ros_releases.py scripts/set-up
	scripts/set-up $(VENV)
	@touch $@

demo: $(READY)
	$(VENV)/bin/antenna-drive demo

test: $(READY)
	$(PY) -m pytest $(WORKERS) -m 'not trial' $(PYTEST_ARGS)

trials: $(READY)
	$(PY) -m pytest -m trial $(PYTEST_ARGS)

campaign: $(READY)
	$(VENV)/bin/lab campaign --out out/campaign --json out/campaign.json $(CAMPAIGN_ARGS)

quick: $(READY)
	$(PY) -m pytest $(WORKERS) -m 'not slow and not trial' $(PYTEST_ARGS)

lint: $(READY)
	$(PY) -m pytest test/lint $(PYTEST_ARGS)

bench: $(READY)
	$(PY) -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	$(VENV)/bin/lab bench

clean:
	rm -rf $(VENV) build dist install log out *.egg-info .pytest_cache .mypy_cache .hypothesis
	find . -name __pycache__ -not -path './.venv*' -prune -exec rm -rf {} +
