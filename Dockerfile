# lightpaint on any machine: the command, and a worker of a Dask cluster (docs/batch.md).
#
#     docker build -t lightpaint .
#     docker run --rm -v "$PWD:/work" lightpaint batch looks.toml -o looks/
#
# Once it is built it needs no network. It runs as nobody in particular; --user "$(id -u)" gives
# results to who runs it.

FROM python:3.11-slim AS build
WORKDIR /src
COPY pyproject.toml constraints.txt MANIFEST.in README.md LICENSE ./
COPY lightpaint lightpaint
# The demo's room and painting, which the package links to.
COPY scenes/gallery scenes/gallery
COPY targets/gallery targets/gallery
# The last command starts this Python, which ends what a wheel leaves to its first start, as root.
RUN python -m venv /opt/lightpaint \
    && /opt/lightpaint/bin/pip install --no-cache-dir -c constraints.txt '.[cluster,usd]' \
    && /opt/lightpaint/bin/pip uninstall --yes pip setuptools

FROM python:3.11-slim
# What Dr.Jit's library asks of the system, and a slim one lacks.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libatomic1 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --system --no-create-home --uid 65532 lightpaint \
    && install -d -m 1777 /cache /work
COPY --from=build /opt/lightpaint /opt/lightpaint
# Bases, and what is compiled for this processor, go to a volume that may outlive the container.
ENV PATH=/opt/lightpaint/bin:$PATH HOME=/cache LIGHTPAINT_CACHE=/cache PYTHONUNBUFFERED=1
VOLUME /cache
WORKDIR /work
USER 65532
STOPSIGNAL SIGTERM
ENTRYPOINT ["lightpaint"]
CMD ["--help"]
