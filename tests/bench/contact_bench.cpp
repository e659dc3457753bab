// What 50 awake bodies on a map cost a step: the contact stage beside ODE's own triangle mesh of the same
// map.
//
//   contact_bench [--steps N] [--source NAME]
//
// NAME is a synthetic room (default synthetic:bedroom), mapped for 40 frames. ODE has one allocator a
// process, and the stage fences it in; so the mesh lives in a child process, and the two take turns of 60
// steps, that a machine which slows down meanwhile slows both. Timed is the thread's processor time.
#include <ode/ode.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "pipeline/contact/body_geom.hpp"
#include "pipeline/contact/field_contacts.hpp"
#include "pipeline/contact/map_field.hpp"
#include "pipeline/map/mesh.hpp"
#include "rt/heap_guard.hpp"
#include "tests/pipeline/contact/analytic_field.hpp"
#include "tests/pipeline/contact/level_drops.hpp"
#include "tests/pipeline/spine/session.hpp"

namespace tactus::bench {
namespace {

using contact::BodySpec;

double now_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

struct Figures {
  std::vector<double> steps_us;
  std::uint64_t contacts = 0, heap_calls = 0;

  void print(const char* what, std::size_t bodies) {
    std::sort(steps_us.begin(), steps_us.end());
    const auto steps = static_cast<double>(steps_us.size());
    std::printf(
        "  %-22s %7.1f us p50 %7.1f us p99   %6.1f contacts   %7.1f heap calls a step   %zu bodies left\n",
        what, steps_us[steps_us.size() / 2], steps_us[steps_us.size() * 99 / 100],
        static_cast<double>(contacts) / steps, static_cast<double>(heap_calls) / steps, bodies);
  }
};

/// The same bodies, solver and step on ODE's triangle mesh.
class MeshWorld {
 public:
  MeshWorld(const map::Map& map, std::span<const BodySpec> specs) {
    dInitODE2(0);
    world_ = dWorldCreate();
    space_ = dSimpleSpaceCreate(nullptr);
    joints_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, 0, -9.81, 0);
    dWorldSetQuickStepNumIterations(world_, 20);
    dWorldSetContactSurfaceLayer(world_, contact::kContactMarginM);
    dWorldSetContactMaxCorrectingVel(world_, 1);
    dWorldSetCFM(world_, 1e-9);
    dWorldSetAutoDisableFlag(world_, 0);

    const double start = now_us();
    mesh_ = map::extract_mesh(map);
    const double extracted = now_us();
    for (const map::MeshVertex& v : mesh_.vertices) {
      vertices_.push_back(v.position_world_m.x);
      vertices_.push_back(v.position_world_m.y);
      vertices_.push_back(v.position_world_m.z);
    }
    data_ = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildSingle(data_, vertices_.data(), 3 * sizeof(float),
                                static_cast<int>(mesh_.vertices.size()), mesh_.triangles.data(),
                                static_cast<int>(3 * mesh_.triangles.size()), 3 * sizeof(std::uint32_t));
    // Its collider for hulls insists on them.
    dGeomTriMeshDataPreprocess2(data_, 1U << dTRIDATAPREPROCESS_BUILD_FACE_ANGLES, nullptr);
    const double built = now_us();
    std::printf(
        "mesh of the map: %zu triangles; %.1f ms to extract and %.1f ms to build for ODE, each time the map "
        "changes\n",
        mesh_.triangles.size(), 1e-3 * (extracted - start), 1e-3 * (built - extracted));
    ground_ = dCreateTriMesh(space_, data_, nullptr, nullptr, nullptr);

    specs_.assign(specs.begin(), specs.end());
    const contact::MaterialTable table = contact::default_material_table();
    for (BodySpec& spec : specs_) {
      dBodyID body = dBodyCreate(world_);
      dGeomID geom = contact::create_body_geom(
          space_, spec.shape,
          spec.shape.kind == contact::ShapeKind::hull ? contact::create_spare_hull_geom() : nullptr);
      const dMass mass =
          contact::mass_of(spec.shape, volume_m3(spec.shape) * table.of(spec.material).density_kg_per_m3);
      dBodySetMass(body, &mass);
      dGeomSetBody(geom, body);
      const Quaternion& q = spec.q_world_body;
      const dQuaternion ode_q = {q.w, q.x, q.y, q.z};
      const Vec3d& p = spec.position_world_m;
      dBodySetQuaternion(body, ode_q);
      dBodySetPosition(body, p.x, p.y, p.z);
      bodies_.push_back(body);
    }
  }

  void step(Figures* figures) {
    contacts_ = 0;
    const std::uint64_t calls = rt::heap_guard::thread_calls();
    const double start = now_us();
    dSpaceCollide(space_, this, near_pair);
    dWorldQuickStep(world_, contact::kStepS);
    dJointGroupEmpty(joints_);
    if (figures == nullptr) return;
    figures->steps_us.push_back(now_us() - start);
    figures->heap_calls += rt::heap_guard::thread_calls() - calls;
    figures->contacts += contacts_;
  }

  [[nodiscard]] std::size_t bodies_left() const {
    return static_cast<std::size_t>(std::count_if(
        bodies_.begin(), bodies_.end(), [](dBodyID body) { return dBodyGetPosition(body)[1] > -20; }));
  }

 private:
  static void near_pair(void* self, dGeomID a, dGeomID b) { static_cast<MeshWorld*>(self)->collide(a, b); }
  void collide(dGeomID a, dGeomID b) {
    dContact contacts[contact::kFieldContactsMax];
    const int count = dCollide(a, b, contact::kFieldContactsMax, &contacts[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dContact& c = contacts[i];
      c.surface = {};
      c.surface.mode = dContactApprox1 | dContactSoftCFM;
      c.surface.mu = 0.5;
      c.surface.soft_cfm = 1e-5;
      dJointAttach(dJointCreateContact(world_, joints_, &c), dGeomGetBody(a), dGeomGetBody(b));
    }
    contacts_ += static_cast<std::uint64_t>(count);
  }

  dWorldID world_;
  dSpaceID space_;
  dJointGroupID joints_;
  dGeomID ground_ = nullptr;
  dTriMeshDataID data_;
  map::Mesh mesh_;
  std::vector<float> vertices_;
  std::vector<BodySpec> specs_;
  std::vector<dBodyID> bodies_;
  std::uint64_t contacts_ = 0;
};

constexpr int kTurnSteps = 60;

/// Works and passes the word on, in turns with the other process; who does not begin waits for it first.
template <typename Turn>
void take_turns(int turns, bool begins, int from_other, int to_other, const Turn& turn) {
  for (int i = 0; i < turns; ++i) {
    char word = 0;
    if ((i > 0 || !begins) && read(from_other, &word, 1) != 1) return;
    turn(i);
    if (write(to_other, &word, 1) != 1) return;
  }
}

int run(const std::string& source, int steps) {
  test::Session session(source);
  for (int i = 0; i < 40; ++i)
    if (!session.step()) break;
  const map::Map& map = session.spine.map();
  const map::Reader reader(map);
  std::mt19937 random(5);
  const std::vector<BodySpec> specs =
      test::level_drops(reader, session.spine.rig().depth, session.poses.back(), 50, random);
  std::printf("%s: %u blocks, %zu bodies\n", source.c_str(), map.blocks_used(), specs.size());
  std::fflush(stdout);

  const int turns = std::max(1, steps / kTurnSteps);
  const int settle_turns = 4;  // two seconds, not counted
  int to_child[2], to_parent[2];
  if (pipe(to_child) != 0 || pipe(to_parent) != 0) return 1;
  const pid_t child = fork();
  if (child < 0) return 1;
  Figures figures;
  // Who dies takes the other along: a pipe ends with its last writer.
  close(child == 0 ? to_child[1] : to_child[0]);
  close(child == 0 ? to_parent[0] : to_parent[1]);
  if (child == 0) {
    MeshWorld world(map, specs);
    std::fflush(stdout);
    take_turns(settle_turns + turns, false, to_child[0], to_parent[1], [&](int turn) {
      for (int i = 0; i < kTurnSteps; ++i) world.step(turn < settle_turns ? nullptr : &figures);
    });
    figures.print("ODE, triangle mesh", world.bodies_left());
    std::fflush(stdout);
    _exit(0);
  }
  {
    test::BoundWorld sut(contact::field_of(reader));
    for (const BodySpec& spec : specs) sut.spawn(spec);
    take_turns(settle_turns + turns, true, to_parent[0], to_child[1], [&](int turn) {
      for (int i = 0; i < kTurnSteps; ++i) {
        sut.world.wake_all();
        const std::uint64_t contacts = sut.world.counters().contacts, calls = rt::heap_guard::thread_calls();
        const double start = now_us();
        sut.run_step();
        if (turn < settle_turns) continue;
        figures.steps_us.push_back(now_us() - start);
        figures.heap_calls += rt::heap_guard::thread_calls() - calls;
        figures.contacts += sut.world.counters().contacts - contacts;
      }
    });
    figures.print("contact stage", sut.world.bodies().size());
  }
  int status = 0;
  return waitpid(child, &status, 0) == child ? status : 1;
}

}  // namespace
}  // namespace tactus::bench

int main(int argc, char** argv) {
  std::string source = "synthetic:bedroom";
  int steps = 1200;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string word = argv[i];
    if (word == "--steps") steps = std::atoi(argv[i + 1]);
    if (word == "--source") source = argv[i + 1];
  }
  if (argc % 2 == 0 || steps <= 0) {
    std::fprintf(stderr, "usage: contact_bench [--steps N] [--source synthetic:ROOM]\n");
    return 2;
  }
  return tactus::bench::run(source, steps);
}
