// Homes that a robot learnt on a walk around them, and finds again after a flight.

#include "lab/s06/home_areas.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "lab/s06/chains.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/error.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/route/packed_snapshot.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/simulated_robot.hpp"

namespace panonav::lab {

namespace {

constexpr double home_radius_m = 0.5;
constexpr double view_spacing_m = 0.3;
constexpr double full_turn_rad = 2.0 * std::numbers::pi;

std::vector<Pose2> sample_path(const simulation::FreeSpace& space,
                               const std::vector<Point2>& corners) {
  std::vector<Pose2> path{{corners.front().x_m, corners.front().y_m, 0.0}};
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const auto leg = space.shortest_path(path.back().position(), corners[i]);
    if (!leg) continue;
    for (const Point2& place : std::span(*leg).subspan(1)) {
      path.push_back({place.x_m, place.y_m, 0.0});
    }
  }
  std::vector<Pose2> poses = simulation::resample(path, view_spacing_m);
  simulation::face_path(poses);
  for (Pose2& pose : poses) pose.heading_rad = wrap_angle(pose.heading_rad);
  return poses;
}

// Returns the free place in a direction from home that is at most so far away.
Point2 find_free_place(const simulation::FreeSpace& space, Point2 home, double direction_rad,
                       double away_m) {
  for (; away_m > 0.1; away_m *= 0.9) {
    const Point2 place{home.x_m + away_m * std::cos(direction_rad),
                       home.y_m + away_m * std::sin(direction_rad)};
    if (space.is_free(place)) return place;
  }
  return home;
}

// Petals around home: out, along an arc and back, in rings 2.5 m apart, with as many petals that
// the ways out are as far apart at the end.
std::vector<Pose2> plan_learning_walk(const simulation::FreeSpace& space, Point2 home,
                                      double radius_m) {
  constexpr double ring_m = 2.5;
  const int rings = std::max(1, static_cast<int>(std::lround(radius_m / ring_m)));
  std::vector<Point2> corners{home};
  for (int ring = 1; ring <= rings; ++ring) {
    const double away_m = radius_m * ring / rings;
    const int petals = std::max(4, static_cast<int>(std::lround(2.0 * away_m / ring_m)));
    const double width_rad = full_turn_rad / petals;
    for (int petal = 0; petal < petals; ++petal) {
      for (const double part : {0.0, 0.5}) {
        const double direction_rad = (petal + part + 0.5 * (ring % 2)) * width_rad;
        corners.push_back(find_free_place(space, home, direction_rad, away_m));
      }
      corners.push_back(home);
    }
  }
  return sample_path(space, corners);
}

// A way of this length from home over random places, at most 20 m away from it.
std::vector<Pose2> plan_flight(const simulation::FreeSpace& space, Point2 home, double length_m,
                               Random& random) {
  constexpr double max_away_m = 20.0;
  std::vector<Point2> corners{home};
  double path_m = 0.0;
  while (path_m < length_m) {
    const Point2 next = space.random_pose(random).position();
    if (distance(next, home) > max_away_m) continue;
    path_m += distance(corners.back(), next);
    corners.push_back(next);
  }
  std::vector<Pose2> poses = sample_path(space, corners);
  const auto count = static_cast<std::size_t>(length_m / view_spacing_m) + 1;
  if (poses.size() > count) poses.resize(count);
  return poses;
}

// Returns the packed coefficients of a view at heading 0, as a robot with a compass sees them.
Eigen::VectorXd packed_coefficients(const HomingView& view, double heading_rad) {
  const SnapshotShape shape;
  const HomingView level = rotate(reduce_view(view, shape.rows, shape.components), -heading_rad);
  const HomingView packed = unpack_snapshot(pack_snapshot(level, shape), shape, view.elevations());
  Eigen::VectorXd values(2 * shape.rows * shape.components + 1);
  Eigen::Index i = 0;
  for (int k = 0; k < shape.components; ++k) {
    for (int row = 0; row < shape.rows; ++row) {
      values(i++) = static_cast<double>(packed.a(row, k));
      values(i++) = static_cast<double>(packed.b(row, k));
    }
  }
  values(i) = 1.0;
  return values;
}

// Packed coefficients of views, a row for each one, and the home vectors there.
struct HomeSamples {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd homes;
};

// Returns every other view of a walk.
HomeSamples sample_views(const std::vector<HomingView>& views, const std::vector<Pose2>& walk,
                         std::size_t first) {
  const auto count = static_cast<Eigen::Index>((walk.size() - first + 1) / 2);
  HomeSamples samples{{count, packed_coefficients(views.front(), 0.0).size()}, {count, 2}};
  for (Eigen::Index row = 0; row < count; ++row) {
    const std::size_t i = first + 2 * static_cast<std::size_t>(row);
    samples.inputs.row(row) = packed_coefficients(views[i], walk[i].heading_rad);
    samples.homes.row(row) << walk.front().x_m - walk[i].x_m, walk.front().y_m - walk[i].y_m;
  }
  return samples;
}

// Returns the mean homeward component of fitted home vectors, away from home; -1 without any.
double measure_component(const Eigen::MatrixXd& fitted, const Eigen::MatrixXd& homes) {
  double sum = 0.0;
  double count = 0.0;
  for (Eigen::Index i = 0; i < homes.rows(); ++i) {
    if (homes.row(i).norm() <= home_radius_m) continue;
    sum += fitted.row(i).normalized().dot(homes.row(i).normalized());
    count += 1.0;
  }
  return count > 0.0 ? sum / count : -1.0;
}

// Fits home vectors linearly, and returns the homeward component at the other views. Of the
// strengths of the ridge the best one is taken, for the rival's good.
double measure_regression(const HomeSamples& learnt, const HomeSamples& others) {
  const Eigen::MatrixXd squares = learnt.inputs.transpose() * learnt.inputs;
  const Eigen::MatrixXd products = learnt.inputs.transpose() * learnt.homes;
  const auto size = squares.rows();
  double best = -1.0;
  for (const double part : {1e-6, 1e-4, 1e-2, 1.0}) {
    const double ridge = part * squares.trace() / static_cast<double>(size);
    const Eigen::MatrixXd weights =
        (squares + ridge * Eigen::MatrixXd::Identity(size, size)).ldlt().solve(products);
    best = std::max(best, measure_component(others.inputs * weights, others.homes));
  }
  return best;
}

// Gradient descent with moments [Kingma, Ba 2015] on one matrix of weights.
class Adam {
 public:
  explicit Adam(const Eigen::MatrixXd& weights)
      : mean_(Eigen::ArrayXXd::Zero(weights.rows(), weights.cols())), square_(mean_) {}

  void descend(Eigen::MatrixXd& weights, const Eigen::MatrixXd& slope) {
    constexpr double rate = 0.01;
    mean_keep_ *= 0.9;
    square_keep_ *= 0.999;
    mean_ = 0.9 * mean_ + 0.1 * slope.array();
    square_ = 0.999 * square_ + 0.001 * slope.array().square();
    weights.array() -=
        rate * (mean_ / (1.0 - mean_keep_)) / ((square_ / (1.0 - square_keep_)).sqrt() + 1e-8);
  }

 private:
  Eigen::ArrayXXd mean_;
  Eigen::ArrayXXd square_;
  double mean_keep_ = 1.0;
  double square_keep_ = 1.0;
};

// A network of one hidden layer of nine cells, 821 weights that are not always 0.
struct HomeNetwork {
  static constexpr int hidden = 9;
  Eigen::MatrixXd first;
  Eigen::MatrixXd second;

  [[nodiscard]] Eigen::MatrixXd excite(const Eigen::MatrixXd& inputs) const {
    Eigen::MatrixXd cells(inputs.rows(), hidden + 1);
    cells << (inputs * first).array().tanh().matrix(), Eigen::MatrixXd::Ones(inputs.rows(), 1);
    return cells;
  }
};

HomeNetwork learn_network(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& homes,
                          double penalty, std::uint64_t seed) {
  constexpr int steps = 2000;
  Random random(seed, 9);
  const auto draw = [&random](Eigen::Index rows, Eigen::Index columns) -> Eigen::MatrixXd {
    const double deviation = 1.0 / std::sqrt(static_cast<double>(rows));
    return Eigen::MatrixXd::NullaryExpr(rows, columns,
                                        [&] { return random.normal(0.0, deviation); });
  };
  HomeNetwork network;
  network.first = draw(inputs.cols(), HomeNetwork::hidden);
  network.second = draw(HomeNetwork::hidden + 1, 2);
  Adam first(network.first);
  Adam second(network.second);
  for (int step = 0; step < steps; ++step) {
    const Eigen::MatrixXd cells = network.excite(inputs);
    const Eigen::MatrixXd errors =
        (cells * network.second - homes) / static_cast<double>(inputs.rows());
    const Eigen::MatrixXd back =
        ((errors * network.second.topRows(HomeNetwork::hidden).transpose()).array() *
         (1.0 - cells.leftCols(HomeNetwork::hidden).array().square()))
            .matrix();
    first.descend(network.first, inputs.transpose() * back + penalty * network.first);
    second.descend(network.second, cells.transpose() * errors + penalty * network.second);
  }
  return network;
}

// Learns the network, and returns the homeward component at the other views. Of the penalties on
// large weights the best one is taken.
double measure_network(const HomeSamples& learnt, const HomeSamples& others, std::uint64_t seed) {
  const double input_scale =
      std::sqrt(static_cast<double>(learnt.inputs.size()) / learnt.inputs.squaredNorm());
  const double home_scale = 1.0 / learnt.homes.rowwise().norm().maxCoeff();
  double best = -1.0;
  for (const double penalty : {1e-4, 1e-3, 1e-2}) {
    const HomeNetwork network =
        learn_network(input_scale * learnt.inputs, home_scale * learnt.homes, penalty, seed);
    best = std::max(best,
                    measure_component(network.excite(input_scale * others.inputs) * network.second,
                                      others.homes));
  }
  return best;
}

Pose2 sample_home(const simulation::FreeSpace& space, Random& random) {
  constexpr double max_away_m = 10.0;  // from the middle
  const Point2 middle{0.5 * (space.low().x_m + space.high().x_m),
                      0.5 * (space.low().y_m + space.high().y_m)};
  for (;;) {
    const Pose2 home = space.random_pose(random);
    if (distance(home.position(), middle) <= max_away_m && space.clearance_m(home.position()) > 0.5)
      return home;
  }
}

}  // namespace

WindyOdometry::WindyOdometry(double wind, std::uint64_t seed) : odometry_({}, seed) {
  Random random(seed, 7);
  const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  wind_m_per_m_ = {wind * std::cos(direction_rad), wind * std::sin(direction_rad)};
}

Pose2 WindyOdometry::measure(const Pose2& from, const Pose2& to) {
  Pose2 step = inverse(from) * to;
  const double length_m = std::hypot(step.x_m, step.y_m);
  const Point2 wind = Pose2{0.0, 0.0, -from.heading_rad} * wind_m_per_m_;
  step.x_m -= length_m * wind.x_m;
  step.y_m -= length_m * wind.y_m;
  const Pose2 before = odometry_.pose();
  return inverse(before) * odometry_.advance(step);
}

LearntHome learn_home(const HomingPlace& place, const HomeTask& task, std::uint64_t seed,
                      Executor& executor) {
  Random random(seed, 1);
  LearntHome learnt;
  learnt.home = sample_home(*place.free_space, random);
  std::vector<Pose2> walk =
      plan_learning_walk(*place.free_space, learnt.home.position(), task.radius_m);
  learnt.home = walk.front();
  learnt.walk_m = path_length_m(walk);
  WindyOdometry odometry(task.wind, seed + 1);
  const auto views = simulation::make_each(executor, walk.size(), [&](std::size_t i) {
    return capture_chain_view(place, walk[i], Random(seed, 1000 + i).next());
  });
  HomeAreaLearner learner({}, {.max_bytes = task.max_bytes});
  for (std::size_t i = 0; i < walk.size(); ++i) {
    learner.add(views[i], i == 0 ? Pose2{} : odometry.measure(walk[i - 1], walk[i]));
  }
  learnt.area = learner.finish(executor);
  const HomeSamples samples = sample_views(views, walk, 0);
  const HomeSamples others = sample_views(views, walk, 1);
  learnt.regression_component = measure_regression(samples, others);
  learnt.network_component = measure_network(samples, others, seed);
  return learnt;
}

bool HomeFlight::is_home(double radius_m) const noexcept {
  return state == ChainState::arrived && end_distance_m <= radius_m;
}

bool HomeFlight::has_arrived_elsewhere(double radius_m) const noexcept {
  return state == ChainState::arrived && end_distance_m > radius_m;
}

HomeFlight fly_home(const HomingPlace& place, const LearntHome& home, const HomeTask& task,
                    std::uint64_t seed) {
  Random random(seed, 1);
  const double length_m = random.uniform(task.min_flight_m, task.max_flight_m);
  const std::vector<Pose2> way =
      plan_flight(*place.free_space, home.home.position(), length_m, random);
  WindyOdometry odometry(task.wind, seed + 1);
  HomeFinder finder(home.area.chain);
  Random noise_of_views(seed, 2);
  const auto see = [&](const Pose2& pose) {
    const std::uint64_t noise = noise_of_views.next();
    if (finder.may_be_near()) finder.see(capture_chain_view(place, pose, noise));
  };
  // The robot starts at home at the heading of the walk.
  finder.move(odometry.measure(home.home, way.front()));
  for (std::size_t i = 1; i < way.size(); ++i) {
    finder.move(odometry.measure(way[i - 1], way[i]));
    see(way[i]);
  }
  HomeFlight flight;
  flight.out_m = path_length_m(way);
  const Point2 true_place = inverse(home.home) * way.back().position();
  flight.odometry_error_m = distance(true_place, finder.area_from_robot().position());
  simulation::SimulatedRobot robot(*place.free_space, {}, simulation::ObstacleRule::pass,
                                   way.back(), seed);
  const double max_steps = 2000.0 + 10.0 * flight.out_m;
  for (int step = 0; step <= max_steps; ++step) {
    const ChainDecision decision = finder.decide();
    flight.state = decision.state;
    if (flight.state == ChainState::arrived || flight.state == ChainState::lost) break;
    const Pose2 before = robot.pose();
    if (robot.drive(decision.turn_rad, decision.advance_m).is_stopped) break;
    flight.back_m += distance(before.position(), robot.pose().position());
    finder.move(odometry.measure(before, robot.pose()));
    see(robot.pose());
  }
  flight.end_distance_m = distance(robot.pose().position(), home.home.position());
  return flight;
}

namespace {

// Results of all homes of one task.
struct HomeResults {
  std::vector<HomeFlight> flights;
  std::vector<double> bytes;
  std::vector<double> component;
  std::vector<double> regression_component;
  std::vector<double> network_component;
};

void add_flights(const std::string& id, const std::string& what,
                 const std::vector<HomeFlight>& flights, std::optional<Target> target,
                 Reproduction& result) {
  add_rate(result, id + ".home", what + ": home within 50 cm",
           count_where(flights, [](const HomeFlight& f) { return f.is_home(home_radius_m); }),
           flights.size(), target);
}

// A task, and the results of all homes so far.
struct MeasuredTask {
  std::string id;
  std::string what;
  HomeTask task;
  double min_share = 1.0;
  HomeResults results{};
};

void measure_homes(const HomingPlace& place, const std::string& name, int flights,
                   MeasuredTask& measured, const Experiments& context) {
  const std::uint64_t homes = flights > 1 ? 2 : 1;
  HomeResults& all = measured.results;
  std::vector<HomeFlight> here;
  for (std::uint64_t h = 0; h < homes; ++h) {
    const std::uint64_t seed = 1000 * context.options.seed + 100 * h;
    const LearntHome home = learn_home(place, measured.task, seed, context.executor);
    const auto flown = simulation::make_each(
        context.executor, static_cast<std::size_t>(flights),
        [&](std::size_t f) { return fly_home(place, home, measured.task, seed + 1 + f); });
    here.insert(here.end(), flown.begin(), flown.end());
    all.bytes.push_back(static_cast<double>(home.area.chain.pack().size()));
    all.component.push_back(home.area.homeward_component());
    all.regression_component.push_back(home.regression_component);
    all.network_component.push_back(home.network_component);
  }
  add_flights(measured.id + "." + name, measured.what + " in " + name, here, std::nullopt,
              context.result);
  all.flights.insert(all.flights.end(), here.begin(), here.end());
}

void report_homes(const MeasuredTask& measured, Reproduction& result) {
  const auto& [id, what, task, min_share, all] = measured;
  add_flights(id, what, all.flights, at_least(min_share), result);
  add_rate(result, id + ".elsewhere", what + ": reported arrivals elsewhere",
           count_where(all.flights,
                       [](const HomeFlight& f) { return f.has_arrived_elsewhere(home_radius_m); }),
           all.flights.size(), at_most(0.0));
  add_row(result, id + ".bytes", what + ": largest size of the area",
          *std::max_element(all.bytes.begin(), all.bytes.end()), "B", at_most(task.max_bytes));
  add_mean(result, id + ".component", what + ": homeward component at views that are not stored",
           "", all.component);
  add_mean(result, id + ".regression",
           what + ": the same by ridge regression on packed coefficients, 178 numbers", "",
           all.regression_component);
  add_mean(result, id + ".network",
           what + ": the same by a network of nine hidden cells, 821 numbers", "",
           all.network_component);
  std::vector<double> errors_m;
  for (const HomeFlight& flight : all.flights) errors_m.push_back(flight.odometry_error_m);
  add_median(result, id + ".error", what + ": error of the position at the end of the way out", "m",
             errors_m);
}

}  // namespace

void reproduce_home_areas(int flights, const Experiments& context) {
  require(flights >= 1, "flights", flights, ">= 1");
  std::array<MeasuredTask, 2> tasks{{{"s06.home.near", "home after 30 to 110 m", {}},
                                     {"s06.home.far",
                                      "home after 200 to 600 m with wind",
                                      {.radius_m = 8.0,
                                       .max_bytes = 10'000,
                                       .min_flight_m = 200.0,
                                       .max_flight_m = 600.0,
                                       .wind = 0.1},
                                      0.95}}};
  std::vector<std::string> scenes = list_home_scenes();
  if (flights == 1) scenes = {scenes.back()};  // a smoke test
  for (const std::string& name : scenes) {
    const HomingPlace place = make_homing_place(make_home_scene(name, context.options.seed),
                                                chain_camera(), context.executor);
    for (MeasuredTask& task : tasks) measure_homes(place, name, flights, task, context);
  }
  for (const MeasuredTask& task : tasks) report_homes(task, context.result);
}

}  // namespace panonav::lab
