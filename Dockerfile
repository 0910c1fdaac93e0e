# The tool in a small image: docker build -t strata .
#   docker run --rm --user "$(id -u)" -v "$PWD:/job" strata voxelize part.stl -r 512 -o part.vdb
FROM debian:12-slim AS build
COPY . /strata
WORKDIR /strata
RUN ./dev package -DSTRATA_WITH_PYTHON=OFF -DSTRATA_WITH_OPENVDB=OFF

FROM debian:12-slim
# 40 MB with Debian's libraries. Recommends would bring in the window, X11 and Mesa, 200 MB more.
RUN --mount=type=bind,from=build,source=/strata/build/packages,target=/packages \
    apt-get update && \
    apt-get install -y --no-install-recommends /packages/strata_*.deb fonts-liberation && \
    rm -rf /var/lib/apt/lists/* /var/cache/apt/* /var/log/*.log && \
    useradd --system --uid 999 --home-dir /job --no-create-home strata
USER strata
WORKDIR /job
ENTRYPOINT ["strata"]
CMD ["--help"]
