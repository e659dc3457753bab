// What a question to a finished map costs: map::Reader beside an octree over the same blocks and a plain
// march.
//
//   query_bench DIR [--count N]
//
// DIR is a folder of `tactus run --out`. Points lie up to 2 cm off the surface. Rays start where the camera
// was and go anywhere; timed are those whose hit is 2.5 to 3.5 m away. The ways take turns, so that a machine
// that slows down meanwhile slows all.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include "firmware_host/stored_map.hpp"
#include "pipeline/evaluate/trajectory.hpp"
#include "pipeline/map/cell_list.hpp"
#include "tests/bench/query_peers.hpp"

namespace tactus::bench {
namespace {

struct Ray {
  Vec3f origin_m, direction;
};

double now_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);  // what other work takes away does not count
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

/// Median and least time of a question, in ns, from rounds of 256 questions each.
struct Timing {
  std::vector<double> rounds_ns;
  template <typename Ask>
  void round(std::size_t first, std::size_t count, const Ask& ask) {
    const double begin = now_ns();
    for (std::size_t i = first; i < first + count; ++i) ask(i);
    rounds_ns.push_back((now_ns() - begin) / static_cast<double>(count));
  }
  void print(const char* what) {
    std::sort(rounds_ns.begin(), rounds_ns.end());
    std::printf("  %-28s %8.0f ns p50 %8.0f ns least\n", what, rounds_ns[rounds_ns.size() / 2],
                rounds_ns.front());
  }
};

int run(const std::string& folder, std::size_t count) {
  const auto stored = firmware::load_map(folder);
  if (!stored) {
    std::fprintf(stderr, "query_bench: %s\n", stored.error().message.c_str());
    return static_cast<int>(stored.error().code);
  }
  const map::Map& map = (*stored)->map;
  const map::Reader reader(map);
  const BlockOctree octree(map);
  std::vector<map::SurfaceCell> cells(map::count_surface_cells(map));
  (void)map::gather_surface_cells(map, cells);
  if (cells.empty()) {
    std::fprintf(stderr, "query_bench: %s: holds no surface.\n", folder.c_str());
    return 3;
  }
  const auto path = evaluate::read_trajectory(std::filesystem::path(folder) / "trajectory.txt");
  if (!path || path->poses.empty()) {
    std::fprintf(stderr, "query_bench: %s: holds no trajectory.\n", folder.c_str());
    return 3;
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto direction = [&] {
    Vec3f d;
    do d = {uniform(random), uniform(random), uniform(random)};
    while (!(d.norm() > 0.1F && d.norm() < 1));
    return d.normalized();
  };

  std::vector<Vec3f> points;
  std::vector<Ray> rays;
  std::size_t asked = 0, differ_octree = 0, differ_march = 0;
  double away_octree = 0, away_march = 0;
  while (points.size() < count || rays.size() < count) {
    const map::SurfaceCell& cell = cells[random() % cells.size()];
    points.push_back(cell.position_world_m + cell.normal_world * (0.02F * uniform(random)));
    const Ray ray{path->poses[random() % path->poses.size()].T_world_depth.translation.cast<float>(), direction()};
    map::SurfacePoint ours;
    PeerHit by_octree, by_march;
    const bool hit = reader.raycast(ray.origin_m, ray.direction, 5, ours);
    const bool hit_octree = raycast_octree(map, octree, ray.origin_m, ray.direction, 5, by_octree);
    const bool hit_march = raycast_march(map, ray.origin_m, ray.direction, 5, by_march);
    const float voxel = map.config().voxel_size_m;
    const auto compare = [&](bool other, const PeerHit& at, std::size_t& differ, double& away) {
      if (other != hit) {
        ++differ;
        return;
      }
      if (!hit) return;
      const float gap = (at.position_world_m - ours.position_world_m).norm() / voxel;
      differ += gap > 0.5F;
      away += static_cast<double>(std::min(gap, 0.5F));
    };
    ++asked;
    compare(hit_octree, by_octree, differ_octree, away_octree);
    compare(hit_march, by_march, differ_march, away_march);
    const float range_m = hit ? (ours.position_world_m - ray.origin_m).norm() : 0;
    if (range_m > 2.5F && range_m < 3.5F) rays.push_back(ray);
    if (asked > 1000 * count) break;
  }
  points.resize(std::min(points.size(), count));
  rays.resize(std::min(rays.size(), count));
  std::printf("%u blocks, %zu surface cells; octree %.1f KB beside the map\n", map.blocks_used(),
              cells.size(), static_cast<double>(octree.bytes()) / 1e3);
  std::printf(
      "%zu rays: %.3f %% hit elsewhere by the octree (mean %.4f voxels), %.3f %% by the march (%.4f)\n",
      asked, 100.0 * static_cast<double>(differ_octree) / static_cast<double>(asked),
      away_octree / static_cast<double>(asked),
      100.0 * static_cast<double>(differ_march) / static_cast<double>(asked),
      away_march / static_cast<double>(asked));

  constexpr std::size_t kRound = 256;
  Timing nearest, nearest_by_octree, ray, ray_by_octree, ray_by_march;
  std::size_t found = 0;  // so that nothing is left out
  for (int pass = 0; pass < 3; ++pass) {
    for (std::size_t i = 0; i + kRound <= points.size(); i += kRound) {
      nearest.round(i, kRound, [&](std::size_t k) {
        map::SurfacePoint out;
        found += reader.nearest_surface(points[k], out);
      });
      nearest_by_octree.round(i, kRound, [&](std::size_t k) {
        PeerHit out;
        found += nearest_octree(map, octree, points[k], out);
      });
    }
    for (std::size_t i = 0; i + kRound <= rays.size(); i += kRound) {
      ray.round(i, kRound, [&](std::size_t k) {
        map::SurfacePoint out;
        found += reader.raycast(rays[k].origin_m, rays[k].direction, 5, out);
      });
      ray_by_octree.round(i, kRound, [&](std::size_t k) {
        PeerHit out;
        found += raycast_octree(map, octree, rays[k].origin_m, rays[k].direction, 5, out);
      });
      ray_by_march.round(i, kRound, [&](std::size_t k) {
        PeerHit out;
        found += raycast_march(map, rays[k].origin_m, rays[k].direction, 5, out);
      });
    }
  }
  std::printf("material of the nearest surface (%zu points):\n", points.size());
  nearest.print("map::Reader");
  nearest_by_octree.print("octree");
  std::printf("material along a ray of 3 m (%zu rays):\n", rays.size());
  ray.print("map::Reader");
  ray_by_octree.print("octree");
  ray_by_march.print("march, half a voxel");
  return found > 0 ? 0 : 1;
}

}  // namespace
}  // namespace tactus::bench

int main(int argc, char** argv) {
  if (argc != 2 && !(argc == 4 && std::string(argv[2]) == "--count")) {
    std::fprintf(stderr, "usage: query_bench DIR [--count N]\n");
    return 2;
  }
  return tactus::bench::run(argv[1], argc == 4 ? std::strtoul(argv[3], nullptr, 10) : 4096);
}
