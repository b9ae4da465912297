#!/bin/sh
# usage: bench/server_bench.sh BUILD    BUILD: the folder of the build, such as build/bench
# Starts a PostgreSQL server in a temporary folder and runs server_bench against it, both on one core: as the owner of
# the schema, and as a contributor, whom row-level security watches.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
server="$here/../apps/panonav/panonav-postgresql"
trap '"$server" "$folder" stop; rm -rf "$folder"' EXIT
taskset -c 0 "$server" "$folder" start
address=$("$server" "$folder" address bench)
echo "as the owner"
taskset -c 0 "$1/bin/server_bench" "$address"
psql -X -q -h "$folder" -U panonav -d panonav \
  -c "CREATE ROLE adds LOGIN IN ROLE panonav_contributor; INSERT INTO panonav.members VALUES ('adds', 'north')"
echo "as a contributor"
taskset -c 0 "$1/bin/server_bench" "$(echo "$address" | sed 's/user=panonav/user=adds/')"
first=$(head -1 "$folder/data/postmaster.pid")
# shellcheck disable=SC2046
ticks=$(cat "/proc/$first/stat" $(pgrep -P "$first" | sed 's|.*|/proc/&/stat|') |
  awk '{ sub(/.*\) /, ""); total += $12 + $13 + $14 + $15 } END { print total }')
echo "server: $((ticks * 1000 / $(getconf CLK_TCK))) ms of processor time for both"
