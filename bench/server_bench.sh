#!/bin/sh
# usage: bench/server_bench.sh BUILD    BUILD: the folder of the build, such as build/bench
# Starts a PostgreSQL server in a temporary folder and runs server_bench against it, both on one core.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
server="$here/../apps/panonav/panonav-postgresql"
trap '"$server" "$folder" stop; rm -rf "$folder"' EXIT
taskset -c 0 "$server" "$folder" start
address=$("$server" "$folder" address bench)
taskset -c 0 "$1/bin/server_bench" "$address"
first=$(head -1 "$folder/data/postmaster.pid")
ticks=$(cat /proc/"$first"/stat $(pgrep -P "$first" | sed 's|.*|/proc/&/stat|') |
  awk '{ sub(/.*\) /, ""); total += $12 + $13 + $14 + $15 } END { print total }')
echo "server: $((ticks * 1000 / $(getconf CLK_TCK))) ms of processor time in all"
