"""Makes the ROS 1 bags of tests/io/data with Debian's python3-rosbag: rosbag_files.py FOLDER.

Messages are those of mcap_core.mjs. `bag_unclosed.bag` is what a killed recorder leaves."""
import pathlib
import shutil
import sys

import genpy
import rosbag
from std_msgs.msg import String

folder = pathlib.Path(sys.argv[1])


def write(bag: rosbag.Bag) -> None:
    for i in range(20):
        data = bytes((7 * i + k) & 255 for k in range(10 + 3 * i))
        stamp = genpy.Time.from_sec(1) + genpy.Duration(nsecs=10_000_000 * i)
        topic = "/text" if i % 3 == 2 else "/imu"
        bag.write(topic, (String._type, data, String._md5sum, 0, String), stamp, raw=True)


for name in ("none", "bz2", "lz4"):
    with rosbag.Bag(folder / f"bag_{name}.bag", "w", compression=name, chunk_threshold=400) as bag:
        write(bag)
bag = rosbag.Bag(folder / "open.bag", "w", chunk_threshold=400)
write(bag)
bag.flush()
shutil.copy(folder / "open.bag", folder / "bag_unclosed.bag")
bag.close()
(folder / "open.bag").unlink()
