# panonav in a container, in two stages: the packages are built, and installed into a clean system.
#   docker build -t panonav --build-arg SOURCE_DATE_EPOCH="$(git log -1 --format=%ct)" .
#   docker run --rm -v "$PWD:/data" panonav localise office.panonav query_run
# A camera: --device /dev/video0; ROS 2 and --view: --network host.
FROM debian:bookworm-slim AS build
ARG SOURCE_DATE_EPOCH=1767225600
WORKDIR /panonav
COPY run ./
# Of the script alone, so that a change of the sources does not install everything again.
RUN apt-get update && ./run setup && apt-get install -y --no-install-recommends dpkg-dev file && rm -rf /var/lib/apt/lists/*
COPY . .
RUN SOURCE_DATE_EPOCH=$SOURCE_DATE_EPOCH tools/make_packages /packages

FROM debian:bookworm-slim
COPY --from=build /packages/panonav_*.deb /packages/libpanonav0_*.deb /packages/python3-panonav_*.deb /packages/
RUN apt-get update && \
    apt-get install -y --no-install-recommends /packages/*.deb ffmpeg && \
    rm -rf /var/lib/apt/lists/* /packages && \
    useradd --create-home --groups video robot
USER robot
WORKDIR /data
ENTRYPOINT ["panonav"]
CMD ["--help"]
