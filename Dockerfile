# The project in a container, on the bare system that .ci/bare-machine makes (docs/install.md).
FROM debian:12-slim
RUN apt-get update && apt-get install --yes --no-install-recommends \
    ca-certificates git make python3 python3-venv
WORKDIR /mortarcheck
# The packages first: a change of the project does not install them again.
COPY Makefile pyproject.toml requirements*.txt ./
COPY workflow/libraries.py workflow/
RUN make environment
COPY . .
CMD ["make", "all-cases"]
