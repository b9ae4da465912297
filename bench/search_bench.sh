#!/bin/sh
# usage: bench/search_bench.sh BUILD [VIEWS [FOLDER]]    BUILD: the folder of the build, such as build/bench
# Starts a PostgreSQL server in FOLDER (a temporary one), fills it with VIEWS views (10,000,000, which take 30 GB) and
# searches in them. A FOLDER that is given keeps its views and is not filled again.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
views=${2:-10000000}
server="$here/../apps/panonav/panonav-postgresql"
if [ $# -ge 3 ]; then
  folder=$3
  trap '"$server" "$folder" stop' EXIT
else
  folder=$(mktemp -d)
  trap '"$server" "$folder" stop; rm -rf "$folder"' EXIT
fi
"$server" "$folder" start shared_buffers=512MB max_wal_size=4GB
address=$("$server" "$folder" address "views$views")
"$1/bin/search_bench" fill "$address" "$views"
du -sh "$folder/data/base" | sed 's/\t.*/ on the disk/'
"$1/bin/search_bench" ask "$address" "$views"
