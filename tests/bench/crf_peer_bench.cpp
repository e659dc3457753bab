// The paper's own cloud through the paper's own CRF (PCL's) and through ours: agreement, energy, time,
// memory.
//
//   crf_peer_bench [FOLDER] [--repeats N] [--no-energy] [--dump FILE]
//
// FOLDER (or $TACTUS_PAPER_CLOUD) holds source.pcd and labelled.pcd as the paper's authors published them.
// --dump writes the cells as crf_fit reads them, with the labels going in as truth.
//
// PCL 1.13's CrfSegmentation has traits that had to be dealt with:
//   - its cell coordinates are (x, y, y): the third is computed from y again, so height does not count;
//   - the cost of the label that was said lands in slot labels.size() instead of the label's own: with ten
//   labels that
//     is the next cell's first slot, which the next cell overwrites; the label said hardly counts;
//   - ten labels at most, in order of appearance; the rest and 0 are unlabelled; label 1 is believed to 0.2,
//   others to
//     0.9;
//   - theta divides integer cell coordinates and colours of 0 to 255; kernels are normalised by each cell's
//   own degree,
//     own contribution included (our per_point).
// So it is run twice: as it is, and as its engine pcl::DenseCrf fed with the right coordinates and costs
// ("repaired"), which is what ours is compared with.
#include <pcl/ml/densecrf.h>
#include <pcl/segmentation/crf_segmentation.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "pipeline/label/crf/batch_crf.hpp"
#include "pipeline/label/crf/brute_crf.hpp"
#include "tests/bench/crf_points_file.hpp"

namespace tactus::bench {
namespace {

constexpr float kCellM = 0.01F;
constexpr std::size_t kLabelsMax = 10;

// Processor time: what the machine's other work takes away does not count.
double seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// A PCD file's columns by field name, every value as double (the packed colour and the label fit exactly).
std::map<std::string, std::vector<double>> read_pcd(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<std::string> fields, types;
  std::size_t points = 0;
  std::string line, data;
  while (data.empty() && std::getline(in, line)) {
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    if (key == "FIELDS")
      while (words >> word) fields.push_back(word);
    if (key == "TYPE")
      while (words >> word) types.push_back(word);
    if (key == "POINTS") words >> points;
    if (key == "DATA") words >> data;
  }
  std::map<std::string, std::vector<double>> columns;
  for (std::size_t i = 0; i < points; ++i)
    for (std::size_t f = 0; f < fields.size(); ++f) {
      double value = 0;
      if (data == "ascii") {
        in >> value;
      } else {
        std::uint32_t bits = 0;
        in.read(reinterpret_cast<char*>(&bits), 4);
        float real = 0;
        std::memcpy(&real, &bits, 4);
        value = types[f] == "F" ? static_cast<double>(real) : bits;
      }
      columns[fields[f]].push_back(value);
    }
  if (!in) std::fprintf(stderr, "%s: ends too early\n", path.c_str());
  return columns;
}

// PCL's segmentation with its insides in reach.
struct PclCrf : pcl::CrfSegmentation<pcl::PointXYZRGBA> {
  using Base = pcl::CrfSegmentation<pcl::PointXYZRGBA>;
  void prepare() {
    createVoxelGrid();
    createDataVectorFromVoxelGrid();
  }
  std::vector<Eigen::Vector3i, Eigen::aligned_allocator<Eigen::Vector3i>> cells() {
    std::vector<Eigen::Vector3i, Eigen::aligned_allocator<Eigen::Vector3i>> out;
    for (const auto& p : filtered_anno_->points) out.push_back(voxel_grid_.getGridCoordinates(p.x, p.y, p.z));
    return out;
  }
  using Base::color_;
  using Base::filtered_anno_;
  using Base::normal_;
};

struct Clouds {
  pcl::PointCloud<pcl::PointXYZRGBA>::Ptr input{new pcl::PointCloud<pcl::PointXYZRGBA>};
  pcl::PointCloud<pcl::PointXYZRGBL>::Ptr labelled{new pcl::PointCloud<pcl::PointXYZRGBL>};
  pcl::PointCloud<pcl::PointNormal>::Ptr normals{new pcl::PointCloud<pcl::PointNormal>};
};

Clouds read_clouds(const std::string& folder) {
  const auto source = read_pcd(folder + "/source.pcd"), labels = read_pcd(folder + "/labelled.pcd");
  Clouds clouds;
  for (std::size_t i = 0; i < source.at("x").size(); ++i) {
    const auto get = [&](const char* field) { return static_cast<float>(source.at(field)[i]); };
    pcl::PointXYZRGBA p;
    pcl::PointXYZRGBL l;
    pcl::PointNormal n;
    p.x = l.x = n.x = get("x");
    p.y = l.y = n.y = get("y");
    p.z = l.z = n.z = get("z");
    p.rgba = static_cast<std::uint32_t>(source.at("rgba")[i]);
    l.rgba = p.rgba;
    l.label = static_cast<std::uint32_t>(labels.at("label")[i]);
    n.normal_x = get("normal_x");
    n.normal_y = get("normal_y");
    n.normal_z = get("normal_z");
    clouds.input->push_back(p);
    clouds.labelled->push_back(l);
    clouds.normals->push_back(n);
  }
  return clouds;
}

void configure(PclCrf& crf, const Clouds& clouds) {
  crf.setInputCloud(clouds.input);
  crf.setAnnotatedCloud(clouds.labelled);
  crf.setNormalCloud(clouds.normals);
  crf.setVoxelGridLeafSize(kCellM, kCellM, kCellM);
  crf.setNumberOfIterations(30);
  crf.setSmoothnessKernelParameters(3, 3, 3, 1.3F);
  crf.setAppearanceKernelParameters(30, 30, 30, 20, 20, 20, 4);
  crf.setSurfaceKernelParameters(5, 5, 5, 0.1F, 0.1F, 0.1F, 1);
}

struct Timed {
  double median_s = 0, least_s = 0;
};
Timed timed(int repeats, const std::function<void()>& run) {
  std::vector<double> took;
  for (int i = 0; i < repeats; ++i) {
    const double start = seconds();
    run();
    took.push_back(seconds() - start);
  }
  std::sort(took.begin(), took.end());
  return {took[took.size() / 2], took.front()};
}

// How much the resident set grows while `run` works in a process of its own, MB.
double growth_mb(const std::function<void()>& run) {
  int ends[2];
  if (pipe(ends) != 0) return 0;
  const pid_t child = fork();
  if (child == 0) {
    const auto peak_kb = [] {
      rusage usage{};
      getrusage(RUSAGE_SELF, &usage);
      return usage.ru_maxrss;
    };
    const long before = peak_kb();
    run();
    const long grown = peak_kb() - before;
    const bool wrote = write(ends[1], &grown, sizeof(grown)) == sizeof(grown);
    _exit(wrote ? 0 : 1);
  }
  long grown = 0;
  const bool has = read(ends[0], &grown, sizeof(grown)) == sizeof(grown);
  int status = 0;
  waitpid(child, &status, 0);
  close(ends[0]);
  close(ends[1]);
  return has ? static_cast<double>(grown) / 1024 : 0;
}

struct Boot {  // memory for a Slice
  explicit Boot(std::size_t bytes)
      : bytes_(rt::round_up(bytes, rt::kCacheLineBytes)),
        data_(static_cast<std::byte*>(::operator new (bytes_, std::align_val_t{rt::kCacheLineBytes}))) {}
  ~Boot() { ::operator delete (data_, std::align_val_t{rt::kCacheLineBytes}); }
  Boot(const Boot&) = delete;
  Boot& operator=(const Boot&) = delete;
  [[nodiscard]] rt::Slice slice() const { return rt::Slice({data_, bytes_}); }

 private:
  std::size_t bytes_;
  std::byte* data_;
};

double agreement(const std::vector<MaterialId>& a, const std::vector<MaterialId>& b) {
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.size(); ++i) same += a[i] == b[i];
  return 100 * static_cast<double>(same) / static_cast<double>(a.size());
}

struct Ours {
  std::vector<MaterialId> labels;
  label::CrfReport report;
  Timed prepare, solve;
  std::size_t columns = 0;
  std::array<std::uint32_t, 3> vertices{};
};

Ours run_ours(const LabelledPoints& cells, const label::CrfParameters& parameters, int repeats) {
  const auto config = label::BatchCrfConfig::for_points(cells.size());
  const Boot memory(label::BatchCrf::bytes_needed(config));
  rt::Slice slice = memory.slice();
  label::BatchCrf crf;
  crf.bind(slice, config);
  std::vector<float> marginals(cells.size() * kMaterialCount);
  Ours ours;
  ours.labels.resize(cells.size());
  rt::Status status = rt::Status::ok;
  ours.prepare = timed(repeats, [&] { status = crf.prepare(cells.points(), parameters); });
  if (status != rt::Status::ok) {
    std::printf("ours: %s\n", rt::name(status));
    return ours;
  }
  ours.solve = timed(repeats, [&] { ours.report = crf.solve(marginals); });
  label::most_probable(marginals, ours.labels);
  ours.columns = crf.engine().columns_count();
  for (std::size_t m = 0; m < 3; ++m) ours.vertices[m] = crf.engine().vertices_count(m);
  return ours;
}

int run(const std::string& folder, int repeats, bool with_energy, const std::string& dump) {
  const Clouds clouds = read_clouds(folder);
  std::ostringstream swallowed;  // PCL talks while it works
  std::streambuf* const console = std::cout.rdbuf(swallowed.rdbuf());

  PclCrf pcl_crf;
  configure(pcl_crf, clouds);
  pcl_crf.prepare();
  const auto cells = pcl_crf.cells();
  const std::size_t n = cells.size();

  // PCL's own list of labels: the first ten in order of appearance, 0 is none.
  std::vector<std::uint32_t> list;
  std::vector<int> said(n, -1);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t l = (*pcl_crf.filtered_anno_)[i].label;
    if (l == 0) continue;
    auto at = std::find(list.begin(), list.end(), l);
    if (at == list.end() && list.size() < kLabelsMax) at = list.insert(list.end(), l);
    if (at != list.end()) said[i] = static_cast<int>(at - list.begin());
  }
  std::vector<float> unary(n * kLabelsMax);
  LabelledPoints ours_in;
  for (std::size_t i = 0; i < n; ++i) {
    const float believed = said[i] >= 0 && list[static_cast<std::size_t>(said[i])] == 1 ? 0.2F : 0.9F;
    for (std::size_t l = 0; l < kLabelsMax; ++l)
      unary[i * kLabelsMax + l] = said[i] < 0 ? -std::log(1.0F / kLabelsMax)
                                  : said[i] == static_cast<int>(l)
                                      ? -std::log(believed)
                                      : -std::log((1 - believed) / (kLabelsMax - 1));
    // Ours: PCL's ten labels are materials 0 to 9; the other 13 are as improbable as float allows to say.
    for (std::size_t l = 0; l < kMaterialCount; ++l)
      ours_in.unary_nat.push_back(l < kLabelsMax ? unary[i * kLabelsMax + l] : 60.0F);
    const auto meters = [](int c) { return static_cast<float>(c) * kCellM; };
    ours_in.position_m.push_back({meters(cells[i].x()), meters(cells[i].y()), meters(cells[i].z())});
    ours_in.normal.push_back({pcl_crf.normal_[i].x(), pcl_crf.normal_[i].y(), pcl_crf.normal_[i].z()});
    ours_in.color.push_back({static_cast<std::uint8_t>(pcl_crf.color_[i].x()),
                             static_cast<std::uint8_t>(pcl_crf.color_[i].y()),
                             static_cast<std::uint8_t>(pcl_crf.color_[i].z())});
    ours_in.truth.push_back(said[i] < 0 ? kUnknownMaterial : static_cast<MaterialId>(said[i]));
  }
  if (!dump.empty()) {
    const auto written = write_points(dump, ours_in);
    if (!written) std::fprintf(stderr, "%s\n", written.error().message.c_str());
  }

  std::vector<int> repaired(n);
  const auto run_repaired = [&] {
    pcl::DenseCrf crf(static_cast<int>(n), kLabelsMax);
    crf.setUnaryEnergy(unary);
    crf.setDataVector(cells);
    crf.setColorVector(pcl_crf.color_);
    auto coordinates = cells;
    crf.addPairwiseGaussian(3, 3, 3, 1.3F);
    crf.addPairwiseBilateral(30, 30, 30, 20, 20, 20, 4);
    crf.addPairwiseNormals(coordinates, pcl_crf.normal_, 5, 5, 5, 0.1F, 0.1F, 0.1F, 1);
    crf.mapInference(30, repaired);
  };
  pcl::PointCloud<pcl::PointXYZRGBL> as_is;
  const auto run_as_is = [&] {
    PclCrf crf;
    configure(crf, clouds);
    crf.segmentPoints(as_is);
  };
  const double pcl_mb = growth_mb(run_repaired);  // before anything else leaves freed memory behind
  const Timed pcl_as_is = repeats > 0 ? timed(repeats, run_as_is) : Timed{};
  const Timed pcl_repaired = timed(std::max(1, repeats), run_repaired);
  std::cout.rdbuf(console);

  std::vector<MaterialId> pcl_labels(n), unary_labels(n);
  for (std::size_t i = 0; i < n; ++i) {
    pcl_labels[i] = static_cast<MaterialId>(repaired[i]);
    unary_labels[i] = said[i] < 0 ? MaterialId{0} : static_cast<MaterialId>(said[i]);
  }
  std::printf("%zu cells of 1 cm, %zu labels in, %d repeats, median (least) processor time\n", n, list.size(),
              repeats);
  std::printf("pcl::CrfSegmentation as it is    %.3f s (%.3f)\n", pcl_as_is.median_s, pcl_as_is.least_s);
  std::printf("pcl::DenseCrf repaired           %.3f s (%.3f), grows by %.0f MB\n", pcl_repaired.median_s,
              pcl_repaired.least_s, pcl_mb);
  if (repeats > 0) {
    std::vector<MaterialId> as_is_labels(n);
    for (std::size_t i = 0; i < n; ++i)
      as_is_labels[i] =
          static_cast<MaterialId>(std::find(list.begin(), list.end(), as_is[i].label) - list.begin());
    std::printf("  as it is and repaired agree in %.2f %% of cells\n", agreement(as_is_labels, pcl_labels));
  }

  std::vector<double> degree(3 * n);
  const label::CrfParameters paper = label::paper_crf_parameters();
  if (with_energy) label::degrees_of(ours_in.points(), paper, degree);
  const auto print_energy = [&](const char* what, const std::vector<MaterialId>& labels) {
    if (!with_energy) return;
    const label::CrfEnergy e = label::energy_of(ours_in.points(), paper, labels, degree);
    std::printf("  energy of %-24s %.1f nat = unary %.1f + pairwise %.1f\n", what, e.total_nat(), e.unary_nat,
                e.pairwise_nat);
  };
  print_energy("the labels going in", unary_labels);
  print_energy("PCL repaired", pcl_labels);

  // The same with 23 different columns: each material's cost moved by one part in ten million at one cell.
  LabelledPoints all_columns = ours_in;
  for (std::size_t l = 0; l < kMaterialCount; ++l)
    all_columns.unary_nat[l * kMaterialCount + l] += 1e-5F * static_cast<float>(l + 1);
  label::CrfParameters settled = paper, symmetric = paper;
  settled.settled_change = 1e-3F;
  symmetric.normalisation = label::CrfNormalisation::symmetric;
  const auto print_ours = [&](const char* what, const LabelledPoints& in,
                              const label::CrfParameters& parameters, bool is_same_problem) {
    const Ours ours = run_ours(in, parameters, std::max(1, repeats));
    const double total_s = ours.prepare.median_s + ours.solve.median_s;
    std::printf(
        "ours, %-26s %.3f s = prepare %.3f (%.3f) + solve %.3f (%.3f), %d iterations, %zu columns, vertices "
        "%u %u %u: "
        "%.1f x PCL; agrees with it in %.2f %% of cells\n",
        what, total_s, ours.prepare.median_s, ours.prepare.least_s, ours.solve.median_s, ours.solve.least_s,
        ours.report.iterations, ours.columns, ours.vertices[0], ours.vertices[1], ours.vertices[2],
        pcl_repaired.median_s / total_s, agreement(ours.labels, pcl_labels));
    if (is_same_problem) print_energy(what, ours.labels);
  };
  print_ours("paper", ours_in, paper, true);
  print_ours("paper, settled at 1e-3", ours_in, settled, true);
  print_ours("paper, 23 columns", all_columns, paper, false);
  print_ours("paper, symmetric", ours_in, symmetric, false);
  std::printf(
      "ours grows by %.0f MB (planned %.0f MB)\n",
      growth_mb([&] { static_cast<void>(run_ours(ours_in, paper, 1)); }),
      static_cast<double>(label::BatchCrf::bytes_needed(label::BatchCrfConfig::for_points(n))) / (1 << 20));
  return 0;
}

}  // namespace
}  // namespace tactus::bench

int main(int argc, char** argv) {
  const char* const from_environment = std::getenv("TACTUS_PAPER_CLOUD");
  std::string folder = from_environment == nullptr ? "" : from_environment, dump;
  int repeats = 5;
  bool with_energy = true;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--no-energy")
      with_energy = false;
    else if (argument == "--repeats" && i + 1 < argc)
      repeats = std::atoi(argv[++i]);
    else if (argument == "--dump" && i + 1 < argc)
      dump = argv[++i];
    else
      folder = argument;
  }
  if (folder.empty() || !std::filesystem::exists(folder + "/source.pcd") ||
      !std::filesystem::exists(folder + "/labelled.pcd")) {
    std::printf(
        "skipped: no folder with source.pcd and labelled.pcd given (argument or TACTUS_PAPER_CLOUD)\n");
    return 0;
  }
  return tactus::bench::run(folder, repeats, with_energy, dump);
}
