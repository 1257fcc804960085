# ygslam in a container; written after Docker's documentation, not built by us (docs/install.md).
#   docker build -t ygslam .
#   docker run --rm -v "$PWD:/data" --user "$(id -u):$(id -g)" ygslam run SEQUENCE --out out
FROM debian:12-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates
WORKDIR /src
COPY tools/setup.sh tools/requirements.txt tools/
RUN tools/setup.sh program
COPY . .
RUN cmake --preset release -DYGSLAM_BUILD_TESTS=OFF -DYGSLAM_BUILD_BENCH=OFF \
 && cmake --build build/release \
 && cd build/release && cpack -G DEB

FROM debian:12-slim
COPY --from=build /src/build/release/ygslam_*.deb /tmp/ygslam.deb
RUN apt-get update \
 && apt-get install -y --no-install-recommends /tmp/ygslam.deb \
 && rm -rf /tmp/ygslam.deb /var/lib/apt/lists/* \
 && useradd --create-home --uid 1000 ygslam
USER ygslam
WORKDIR /data
ENTRYPOINT ["ygslam"]
CMD ["--help"]
