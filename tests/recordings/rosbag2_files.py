"""Makes the recordings of rosbag2 in tests/io/data, in the layout of its SQLite files of ROS 2 Jazzy:
rosbag2_files.py FOLDER. Messages are those of mcap_core.mjs. Needs the program zstd."""
import pathlib
import sqlite3
import subprocess
import sys

folder = pathlib.Path(sys.argv[1])


def write(path: pathlib.Path, numbers: range, packed: bool) -> None:
    path.unlink(missing_ok=True)
    database = sqlite3.connect(path)
    database.executescript("""PRAGMA page_size=512;
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES (4, 'jazzy');
INSERT INTO topics VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr', '', ''), (2, '/text', 'std_msgs/msg/String', 'cdr', '', '');
""")
    for i in numbers:
        data = bytes((7 * i + k) & 255 for k in range(10 + 3 * i))
        if packed:
            data = subprocess.run(["zstd", "-c"], input=data, capture_output=True, check=True).stdout
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                         (2 if i % 3 == 2 else 1, 1_000_000_000 + 10_000_000 * i, data))
    database.commit()
    database.close()


two = folder / "rosbag2"
two.mkdir(exist_ok=True)
write(two / "rosbag2_0.db3", range(8), False)
write(two / "rosbag2_1.db3", range(8, 20), False)
write(folder / "packed.db3", range(20), True)
(two / "metadata.yaml").write_text("""rosbag2_bagfile_information:
  version: 9
  storage_identifier: sqlite3
  message_count: 20
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - rosbag2_0.db3
    - rosbag2_1.db3
""")
