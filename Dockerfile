# docker build -t bansho . && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/scenes" bansho render campfire.toml
FROM rust:1.95-slim-bookworm AS build
WORKDIR /source
COPY . .
RUN cargo build --release --locked -p bansho-cli

FROM debian:bookworm-slim
RUN apt-get update && apt-get install -y --no-install-recommends ffmpeg && rm -rf /var/lib/apt/lists/*
COPY --from=build /source/target/release/bansho /usr/local/bin/bansho
COPY --from=build /source/scenes /usr/local/share/bansho/scenes
VOLUME /scenes
WORKDIR /scenes
ENTRYPOINT ["bansho"]
