"""Simulated worlds, robots that drive in them, and cameras calibrated from their pictures."""
import math

import numpy
import pytest

import panonav
from conftest import command_json, run_command

SMALL = {"kind": "panorama", "rows": 32, "columns": 128}


def same_files(one, other):
    names = sorted(path.name for path in one.iterdir())
    assert names == sorted(path.name for path in other.iterdir()) and len(names) > 2
    for name in names:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def test_simulate_writes_what_the_command_writes(office, tmp_path):
    drive = panonav.simulate("office", tmp_path / "drive", path="tour", spacing_m=0.3, seed=3, **SMALL)
    same_files(tmp_path / "drive", office / "drive")
    assert drive[0].odometry == panonav.Pose2() and len(drive) == len(panonav.Dataset(office / "drive"))
    world = panonav.SimulatedWorld("office", **SMALL)
    world.record(tmp_path / "query", path="random", poses=6, seed=7)
    same_files(tmp_path / "query", office / "query_run")
    rows = [[i, x, y, math.degrees(h)] for i, (x, y, h) in enumerate(world.plan(path="walk", poses=4))]
    numpy.savetxt(tmp_path / "walk.csv", rows, "%.17g", ",", header="stamp_s,x_m,y_m,heading_deg", comments="")
    options = ["--light", 0.5, "--tilt-rad", 0.02, "--odometry-drive", "holonomic"]
    run_command("simulate", "office", tmp_path / "theirs", "--trajectory", tmp_path / "walk.csv", *options, "--kind",
                "panorama", "--rows", 32, "--columns", 128, "--quiet")
    panonav.simulate("office", tmp_path / "ours", trajectory=panonav.read_trajectory(tmp_path / "walk.csv"),
                     light=0.5, tilt_rad=0.02, odometry_drive="holonomic", **SMALL)
    same_files(tmp_path / "ours", tmp_path / "theirs")


def test_impossible_poses_are_warned_of(tmp_path):
    with pytest.warns(UserWarning, match="^trajectory: the robot cannot be at 1 of 2"):
        panonav.simulate("office", tmp_path / "out", trajectory=[[0, 1, 1, 0], [1, 99, 99, 0]], **SMALL)


def test_worlds(tmp_path):
    world = panonav.SimulatedWorld("office", **SMALL)
    pose = world.random_pose(4)
    assert world.is_free((pose.x_m, pose.y_m)) and not world.is_free((99, 99)) and world.clearance_m((99, 99)) == 0
    picture = world.capture_image(pose, seed=2)
    assert picture.shape == (32, 128) and numpy.array_equal(picture, world.capture_image(pose, seed=2))
    assert not numpy.array_equal(picture, world.capture_image(pose, seed=3))
    way = world.shortest_path(world.tour[0], world.tour[3])
    assert numpy.allclose(way[0], world.tour[0], atol=0.05) and world.shortest_path((99, 99), (0, 0)) is None
    plan = world.floor_plan()
    assert plan.ndim == 2 and plan.max() == 255
    for wrong, line in [(lambda: panonav.SimulatedWorld("nowhere"), "allowed: office, hall"),
                        (lambda: panonav.SimulatedWorld("office", ligt=1), "did you mean 'light'"),
                        (lambda: panonav.SimulatedWorld("office", light=0), "light is 0"),
                        (lambda: panonav.SimulatedWorld(str(tmp_path / "a.obj"), scene_seed=2), "neither a file"),
                        (lambda: world.capture_image((math.nan, 0, 0)), "nan"),
                        (lambda: world.record(tmp_path / "x", spacing_m=0), "spacing_m is 0"),
                        (lambda: world.record(tmp_path / "x", trajectory=numpy.zeros((0, 4))), "poses of trajectory"),
                        (lambda: panonav.SimulatedRobot(world, (99, 99, 0)), "a free place")]:
        with pytest.raises(ValueError) as caught:
            wrong()
        assert line in str(caught.value) and "\n" not in str(caught.value)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    with pytest.raises(panonav.FileError, match="not empty"):
        world.record(tmp_path / "full")
    (tmp_path / "a.obj").write_text("nothing")
    with pytest.raises(panonav.OptionError, match="scene_seed varies built-in scenes only"):
        panonav.SimulatedWorld(str(tmp_path / "a.obj"), scene_seed=2)
    with pytest.raises(panonav.Error):
        panonav.SimulatedWorld(str(tmp_path / "a.obj"))


def test_a_robot_drives_until_something_is_in_its_way():
    world = panonav.SimulatedWorld("office", odometry_translation_scale_error=0, **SMALL)
    x, y = world.tour[0]
    robot = panonav.SimulatedRobot(world, (x, y, 0.0), seed=2)
    assert robot.drive(0.2, seconds=0.5) and robot.pose.x_m == pytest.approx(x + 0.1)
    assert robot.drive(0.0, 1.0, 0.5) and robot.pose.heading_rad == pytest.approx(0.5)
    seen = robot.observe()
    assert seen.stamp_s == 1.0 and seen.pose.x_m == robot.pose.x_m and seen.odometry.x_m == pytest.approx(0.1, abs=0.02)
    assert not numpy.array_equal(seen.picture, robot.observe().picture)
    while robot.drive(0.3, seconds=1.0):
        assert world.is_free((robot.pose.x_m, robot.pose.y_m))
    stopped = robot.pose
    assert not robot.drive(0.3, 0.1, 1.0) and (robot.pose.x_m, robot.pose.y_m) == (stopped.x_m, stopped.y_m)
    robot.teleport_to((x, y, 1.0))
    assert robot.pose == panonav.Pose2(x, y, 1.0) and robot.odometry.x_m > 0.2
    for wrong in ({"forward_m_s": math.nan}, {"forward_m_s": 0.1, "seconds": -1}):
        with pytest.raises(panonav.ContractError):
            robot.drive(**wrong)


def test_navigator(office):
    """That a robot arrives is shown by a notebook."""
    memory = office / "office.panonav"
    names = panonav.MemoryFile(memory).names()
    navigator = panonav.RobotNavigator(memory, names[10], period_s=0.2)
    assert (navigator.goal, navigator.edges_from) == (names[10], "arrangement") and len(navigator.edges) > 20
    robot = panonav.SimulatedRobot(panonav.SimulatedWorld("office", **SMALL), seed=5)
    step = navigator.step(robot.observe())
    assert step.decided and step.decision.to_dict()["state"] == "moving" and step.velocity.turn_rad_s != 0
    assert navigator.name_of(step.decision.nearest) in names
    robot.drive(step.velocity.forward_m_s, step.velocity.turn_rad_s, 0.2)
    assert not navigator.step(robot.observe()).decided
    stopped = navigator.step(robot.observe(), obstacle=True)
    assert stopped.decided and stopped.decision.step == 2 and "obstructed" in stopped.decision.events
    navigator.set_goal(names[0])
    assert navigator.goal == names[0] and navigator.step(robot.observe()).decided
    for wrong in ({"goal": "nowhere"}, {"goal": names[1], "route": "none"}):
        with pytest.raises(panonav.FileError):
            panonav.RobotNavigator(memory, **wrong)
    for wrong in ({"edges": "roads"}, {"step_m": -1}, {"route_levels": 2}):
        with pytest.raises(ValueError):
            panonav.RobotNavigator(memory, names[1], **wrong)
    with pytest.raises(panonav.ContractError):
        navigator.step(numpy.zeros((8, 16), numpy.uint8), obstacle=True)


def test_an_explorer_makes_the_memory_of_a_simulated_robot(tmp_path):
    memory = tmp_path / "explored.panonav"
    world = panonav.SimulatedWorld("office", **SMALL)
    robot = panonav.SimulatedRobot(world, (*world.tour[0], 0.0), seed=3)
    start = robot.pose
    directions = [math.pi / 4 * i for i in range(8)]

    def measure():
        """Free length for the robot's centre in each direction, and its radius."""
        x, y, heading = robot.pose.x_m, robot.pose.y_m, robot.pose.heading_rad
        for direction in directions:
            length = 0.0
            while length < 2.5 and world.is_free((x + length * math.cos(heading + direction),
                                                  y + length * math.sin(heading + direction))):
                length += 0.05
            yield direction, length + world.robot_radius_m if length < 2.5 else math.inf

    explorer = panonav.RobotExplorer(memory, world.source, robot_radius_m=world.robot_radius_m, has_ranges=True,
                                     radius_m=0.4, max_metres=7)
    clear, states, views = True, [], []
    while not states or states[-1] not in ("done", "lost"):
        step = explorer.step(robot.observe(), None if clear else 0.0, list(measure()))
        states.append(step.decision.state)
        if step.decided and step.decision.memorise:
            views.append(robot.pose)
        clear = robot.drive(step.velocity.forward_m_s, step.velocity.turn_rad_s, 0.1)
        assert len(states) < 3000
    assert states[0] == "exploring" and states[-1] == "done" and step.velocity.to_dict()["forward_m_s"] == 0
    assert math.dist((robot.pose.x_m, robot.pose.y_m), (start.x_m, start.y_m)) < 0.3
    assert 7 <= explorer.travelled_m < 20 and explorer.views.shape == (len(views), 3) and len(views) >= 8
    progress = explorer.progress
    assert not progress.is_complete and 0 < progress.covered_m2 < progress.floor_m2
    assert math.dist((start.x_m + explorer.pose.x_m, start.y_m + explorer.pose.y_m),
                     (robot.pose.x_m, robot.pose.y_m)) < 0.3
    explorer.finish()
    file = panonav.MemoryFile(memory)
    assert file.names() == [f"view_{i + 1}" for i in range(len(views))]
    assert panonav.PlaceRecogniser(memory).localise(robot.observe()).position is not None
    for wrong in (lambda: panonav.RobotExplorer(memory, world.source),
                  lambda: panonav.RobotExplorer(tmp_path / "x", world.source, radius=1),
                  lambda: explorer.step(numpy.zeros((32, 128), numpy.uint8)),
                  lambda: explorer.step(robot.observe(), ranges=[[math.nan, 1]])):
        with pytest.raises(panonav.Error):
            wrong()


def test_calibration_finds_the_mirror(tmp_path):
    world = panonav.SimulatedWorld("office")
    picture = world.capture_image(world.random_pose(1))
    panonav.write_png(tmp_path / "seen.png", picture)
    printed = command_json("calibrate", tmp_path / "seen.png", "-o", tmp_path / "theirs.toml", "--profile",
                           "hyperboloidal", "--overlay", tmp_path / "overlay.png")[0]
    mirror = panonav.find_mirror([picture])
    assert [*mirror.centre, mirror.rim_radius_px, mirror.inner_radius_px, mirror.quality, mirror.residual_px] == [
        printed[key] for key in ("centre_u_px", "centre_v_px", "rim_radius_px", "inner_radius_px", "quality",
                                 "residual_px")]
    camera = panonav.camera_from_mirror(mirror, "hyperboloidal", rim_elevation_rad=math.radians(20))
    assert camera == panonav.read_camera(tmp_path / "theirs.toml")
    assert camera.rim_radius_px == pytest.approx(world.source.camera.rim_radius_px, abs=1)
    overlay = panonav.draw_mirror(picture, mirror, 0.0)
    assert numpy.array_equal(overlay, panonav.read_image(tmp_path / "overlay.png"))
    assert panonav.find_mirror([numpy.zeros((64, 64), numpy.uint8)]) is None
    with pytest.raises(panonav.ContractError, match="rim_elevation_rad"):
        panonav.camera_from_mirror(mirror, rim_elevation_rad=0.3)
    with pytest.raises(panonav.ContractError):
        panonav.find_mirror([])
    with pytest.raises(panonav.Error, match="do not determine"):
        panonav.calibrate_dual_fisheye([numpy.full((64, 128), 90, numpy.uint8)])
