# Everything that README's two commands need, with the versions that the kept reports were measured with.
#
#   docker build -t cembench .
#   docker run --rm -v "$PWD/results:/cembench/results" cembench                  # make reproduce
#   docker run --rm cembench make test
FROM python:3.11-slim

# make; git, for the commit in records; what PyMeshLab loads; a browser for the tests of pages.
RUN apt-get update \
 && apt-get install -y --no-install-recommends make git libgl1 libopengl0 libglib2.0-0 chromium chromium-driver \
 && rm -rf /var/lib/apt/lists/*

WORKDIR /cembench
COPY requirements/kept.txt requirements/kept.txt
RUN python -m venv .venv && .venv/bin/python -m pip install --no-cache-dir --require-hashes -r requirements/kept.txt
COPY . .
RUN .venv/bin/python -m pip install --no-cache-dir --no-deps --editable . && touch .venv/ready-to-reproduce

ENV CEMBENCH_MACHINE=container
CMD ["make", "reproduce"]
