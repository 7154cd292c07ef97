# Everything is run from here: `make help` lists the targets.
# Settings: CORES=4 (all), CASES=folder (case files of yours join the batch), QUIET=yes (failures and the outcome alone), PYTHON=python3.12; what to run: FAMILY='hertz*',
# CASE='ssnp170-e*', FAILED=yes (what has not passed, once more); for Snakemake:
# CONFIG='variants=true', ARGS='--dry-run'.

PYTHON ?= python3
CORES ?= all
ARGS =
CONFIG =
QUIET =
CASES =

.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory
# Shells and Snakemake would take such a name apart.
ODD := $(foreach c,$$ { } ` " \ ;,$(findstring $c,$(CURDIR)))
ifneq (,$(strip $(ODD)))
$(error the project's folder has $(strip $(ODD)) in its path: move it to one without)
endif
export PATH := $(CURDIR)/.venv/bin:$(PATH)
# Neither the user's Python packages nor modules in this folder join a run, and nothing is written
# outside it.
unexport PYTHONPATH PYTHONHOME PYTHONSTARTUP
export XDG_CACHE_HOME := $(CURDIR)/.snakemake/cache
export MPLCONFIGDIR := $(XDG_CACHE_HOME)/matplotlib
ALONE := .venv/bin/python -I -m
OURS := .venv/bin/python -EsP solver/__main__.py
TESTS := .venv/bin/python -Es -m
# A folder is taken from where make was called, also with `make -C`; quotes keep names that look like
# numbers, and spaces.
FROM = $(if $(filter-out $(CURDIR),$(PWD)),$(if $(filter /% ~%,$(CASES)),,$(PWD)/))
SETTINGS = $(strip $(CONFIG) $(if $(CASES),"cases=$(FROM)$(CASES)"))
CHOICE = $(if $(FAMILY),"family='$(FAMILY)'") $(if $(CASE),"case='$(CASE)'") \
	$(if $(FAILED),failed=true)
SILENCE = $(if $(QUIET),--quiet rules progress reason host)
SNAKEMAKE = .venv/bin/python -I workflow/start.py --cores $(CORES) $(SILENCE) $(ARGS) \
	$(if $(SETTINGS),--config $(SETTINGS)) --

# The last lines of a run say how many passed and where the report is, also where nothing was to be
# done, but not of an older report where the run is refused; a report of failures is a failure.
define RUN
@mkdir -p .snakemake && touch .snakemake/begun; LEAVE_WITH_MAKE=yes $(SNAKEMAKE) $(1); status=$$?; \
if test $$status = 0; then \
  test ! -f results/report/log || test results/report/log -nt .snakemake/begun \
    || tail -n 1 results/report/log; \
  test ! -s results/report/failures.txt || status=1; \
fi; exit $$status
endef

.PHONY: help all-cases family case report pictures recorded summary compare bench orders study
.PHONY: stability infsup scaling benchmark converge test accept
.PHONY: format lint lock schemas faults mutants kills cluster-test docs bill clean clean-all
.PHONY: environment code-environment test-environment lint-environment docs-environment
.PHONY: bill-environment slurm-environment lock-environment

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/make \1\t\2/p' Makefile | expand -t 18

all-cases: override CONFIG += $(CHOICE)
all-cases: override ARGS += $(if $(FAILED),--forcerun solve)
all-cases: environment ## mesh, solve and check what is not up to date, then report
	$(call RUN,all_cases)

family: override CONFIG += $(CHOICE)
family: environment ## the batch of one family: make family FAMILY=ssnp170
	@test -n "$(FAMILY)" || { echo "make family: name a folder of cases/, FAMILY=…"; exit 2; }
	$(call RUN,all_cases)

case: override CONFIG += $(CHOICE)
case: override ARGS += --forcerun solve
case: environment ## solve one case again, then report: make case CASE=ssnp170-e-swapped
	@test -n "$(CASE)" || { echo "make case: set CASE to the name of a solve, or to a case file"; exit 2; }
	$(call RUN,all_cases)

report: environment ## write the report again from existing results
	$(call RUN,report)

pictures: environment ## draw the README's pictures from the last batch
	@.venv/bin/python docs/site/front.py

recorded: environment ## keep the results of make study and make stability for the first screen
	@.venv/bin/python docs/site/recorded.py

summary: ## print the last report's table, as Markdown
	@cat results/report/summary.md 2>/dev/null \
	  || { echo "make summary: there is no report yet; make all-cases writes it" >&2; exit 2; }

compare: environment ## compare with another batch: make compare BASE=folder [THIS=folder]
	@test -n "$(BASE)" || { echo "make compare: name a folder of results, BASE=…"; exit 2; }
	@$(OURS) compare "$(BASE)" $(if $(THIS),"$(THIS)")

bench: override CONFIG += $(CHOICE) $(if $(CODES),"codes=$(CODES)")
bench: environment ## run other codes on the cases: all installed, or CODES=calculix,kratos
	@$(SNAKEMAKE) bench

orders: override CONFIG += $(CHOICE)
orders: environment ## refine step by step and fit orders of convergence: all or FAMILY=…
	@$(SNAKEMAKE) orders

CONVERGE = $(addprefix cases/,waves/tria3.yaml waves/tria6.yaml waves/quad8.yaml \
	waves/stiff-quad4.yaml manufactured/tria3.yaml manufactured/tria6.yaml manufactured/quad4.yaml \
	manufactured/quad8.yaml polynomial/quad4.yaml polynomial/quad9.yaml lame/cylinders-tria6.yaml \
	lame/cylinders-quad8.yaml lame/oval-tria6.yaml lame/oval-quad9.yaml \
	axisymmetric/tubes-tria6.yaml axisymmetric/spheres-tria6.yaml contact-edge/tria3.yaml \
	partial-waves/quad4.yaml receding/quad8.yaml half-planes/hertz-quad4.yaml)
converge: environment ## uncertainty by refined meshes: of cases with known answers or CASE=my-case.yaml
	@$(OURS) converge $(if $(CASE),"$(CASE)",$(CONVERGE)) \
	  $(if $(LEVELS),--levels $(LEVELS)) -o results/report

study stability infsup scaling benchmark: override CONFIG += $(if $(LEVEL),level=$(LEVEL))
study: environment ## error against run time, all treatments; a part in minutes: LEVEL=quick
	@$(SNAKEMAKE) $@

stability: environment ## numerical stability: vary quantities until the answer breaks; some values: LEVEL=quick
	@$(SNAKEMAKE) $@

infsup: environment ## the inf-sup test of every cell type, and the half-loaded block
	@$(SNAKEMAKE) $@

scaling: environment ## cost up to a million unknowns; a minute: LEVEL=quick; ten million: LEVEL=large
	@$(SNAKEMAKE) $@

benchmark: environment ## time ratios: linear solvers, cut, safeguards, CalculiX
	@$(SNAKEMAKE) $@

test: test-environment ## run the tests
	@$(ALONE) pytest -n auto --dist worksteal $(ARGS)

faults: test-environment ## read 1,000 (or COUNT=…) damaged files: none may pass unnoticed
	@$(TESTS) tests.faults $(or $(COUNT),1000)

pairs: test-environment ## solve every pair of options of a case, compared with formulas; STRENGTH=3
	@$(TESTS) tests.pairs

views: test-environment ## solve 500 (or COUNT=…) random cases elsewhere, in other units, beside others: one answer
	@$(TESTS) tests.views $(or $(COUNT),500) $(or $(SEED),1000)

mutants: test-environment ## plant faults in the core, one at a time, and see which check catches each
	@$(TESTS) tests.faults.mutants

kills: test-environment ## kill runs at 100 random moments and check that the next run recovers
	@$(TESTS) tests.workflow.kills $(ARGS)

cluster-test: test-environment ## compare six solves through a SLURM of one machine with a local run
	@missing=$$($(TESTS) tests.workflow.slurm --missing); \
	if test -n "$$missing"; then echo "make cluster-test: skipped: $$missing"; \
	else $(MAKE) slurm-environment && $(TESTS) tests.workflow.slurm; fi

RESULTS = $(or $(filter %.yaml,$(CASE)),$(wildcard results/*/$(or $(CASE),*)/result.vtkhdf))
accept: environment ## store results as the accepted values and show the difference: all or CASE=…
	@test -n "$(RESULTS)" || { echo "make accept: there is no such result; solve first"; exit 2; }
	@$(OURS) accept $(RESULTS)

format: lint-environment ## format the sources
	@$(ALONE) ruff check --quiet --fix-only .
	@$(ALONE) ruff format .
	@.venv/bin/snakefmt Snakefile workflow

lint: lint-environment ## check format, style, types, and packages for known faults
	$(ALONE) ruff format --check .
	$(ALONE) ruff check .
	.venv/bin/snakefmt --check Snakefile workflow
	$(ALONE) mypy
	.venv/bin/lint-imports --no-logo
	.venv/bin/reuse lint --quiet
	.venv/bin/zizmor --quiet --offline --min-severity medium .github
	.venv/bin/sp-repo-review . > /dev/null
	@rm -f .mypy_cache/audit
	@if $(ALONE) pip_audit --local --progress-spinner off --output .mypy_cache/audit \
	  > .mypy_cache/audit.log 2>&1; then :; \
	elif test -s .mypy_cache/audit; then cat .mypy_cache/audit; exit 1; \
	else echo "packages not audited: $$(tail -n 1 .mypy_cache/audit.log | cut -c 1-99)"; fi

# A stamp for each lock file: its packages are installed again when it changes, and all of them for
# another Python.
VERSION := $(shell $(PYTHON) -Es -c 'import sys; print("%d.%d" % sys.version_info[:2])')
SITE := .venv/lib/python$(VERSION)/site-packages
$(SITE):
	@$(PYTHON) -Es -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is \
	needed, this is %s: name a newer one, as in make PYTHON=python3.12" % sys.version.split()[0])'
	@$(PYTHON) -Es -m venv --clear .venv

PIP = $(ALONE) pip install --quiet --disable-pip-version-check --no-input --no-compile \
	--no-cache-dir --no-deps --require-hashes --only-binary :all: --requirement
# The files name all packages that are needed, and no others.
$(SITE)/installed-run: requirements.txt | $(SITE)
	@echo "Installing requirements.txt into .venv …"
	@$(PIP) requirements.txt
	@-$(ALONE) compileall -q -q -j 0 .venv/lib
	@touch $@

$(SITE)/installed-%: requirements-%.txt $(SITE)/installed-run
	@echo "Installing requirements-$*.txt into .venv …"
	@$(PIP) $<
	@touch $@

# INSTALLED=yes takes the environment as it is. Its Python finds the project from any folder.
environment: ## install the locked packages alone: enough to solve cases of your own
ifndef INSTALLED
	@$(MAKE) --silent $(SITE)/installed-run
	@grep -qxsF "$(CURDIR)" $(SITE)/mortarcheck.pth || echo "$(CURDIR)" > $(SITE)/mortarcheck.pth
	@$(PYTHON) -Es workflow/libraries.py
endif

lint-environment: test-environment
test-environment lint-environment docs-environment bill-environment slurm-environment \
lock-environment: %-environment: environment
	@$(if $(INSTALLED),:,$(MAKE) --silent $(SITE)/installed-$*)

DEBIAN_getfem = python3-getfem
DEBIAN_calculix = calculix-ccx
code-environment: ## install another code: CODE=kratos, ngsolve; as root on Debian getfem, calculix
	@test -n "$(filter kratos ngsolve getfem calculix,$(CODE))" \
	  || { echo "make code-environment: name a code, CODE=kratos, ngsolve, getfem or calculix"; exit 2; }
ifneq ($(DEBIAN_$(CODE)),)
	@apt-get --quiet install --yes --no-install-recommends $(DEBIAN_$(CODE)) \
	  || { echo "make code-environment: $(CODE) is Debian's package $(DEBIAN_$(CODE)); root installs it"; exit 2; }
else
	@$(PYTHON) -Es -m venv --clear .venv-$(CODE)
	@.venv-$(CODE)/bin/python -Es -m pip --disable-pip-version-check install --quiet \
	  --require-hashes --only-binary :all: --requirement requirements-$(CODE).txt
endif

docs: docs-environment ## write the documentation as a site into results/docs
	@$(ALONE) sphinx --quiet --fresh-env --fail-on-warning --keep-going \
	  -c docs/site -d .sphinx . results/docs
	@.venv/bin/python docs/site/loads.py results/docs

BILL = results/bill-of-materials.json
bill: bill-environment ## write the bill of materials: every installed package and its licence
	@mkdir -p results
	@$(ALONE) cyclonedx_py environment .venv/bin/python --pyproject pyproject.toml \
	  --output-reproducible --output-file $(BILL)
	@echo "Bill of materials: $(BILL)"

LOCK := $(ALONE) uv pip compile --quiet --universal --python-version 3.11 \
	--generate-hashes --no-emit-index-url --no-annotate --custom-compile-command 'make lock' \
	--no-emit-package connection-pool --no-emit-package pulp

lock: lock-environment ## lock the packages of pyproject.toml again: make lock ARGS=--upgrade
	@$(LOCK) $(ARGS) pyproject.toml --group pyproject.toml:batch \
	  --output-file requirements.txt
	@for code in kratos ngsolve; do \
	  $(LOCK) $(ARGS) --group pyproject.toml:$$code --output-file requirements-$$code.txt || exit; done
	@for group in slurm test lint docs bill lock; do \
	  $(LOCK) $(ARGS) --group pyproject.toml:$$group --constraint requirements.txt \
	    --output-file requirements-$$group.txt || exit; done

schemas: environment ## write the JSON Schemas of the typed files, and tables of the documentation
	@.venv/bin/python -m solver.commands.schemas
	@.venv/bin/python docs/site/tables.py

clean: ## remove results and caches
	@find results -mindepth 1 -maxdepth 1 ! -name README.md -exec rm -rf {} +
	@rm -rf .snakemake .sphinx build *.egg-info .pytest_cache .hypothesis .mypy_cache .ruff_cache .import_linter_cache
	@find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

clean-all: clean ## remove the environment too
	@rm -rf .venv .venv-*
