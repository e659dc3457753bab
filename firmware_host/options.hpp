// What the command line says, as plain values.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "firmware_host/open_source.hpp"

namespace tactus::firmware {

/// `tactus run`.
struct RunOptions {
  std::string source;
  std::filesystem::path out;           // empty: no files are written
  std::string runner = "realtime";     // realtime | lockstep
  std::string profile = "x86";         // x86 | headset | paper | FILE.toml
  std::vector<std::string> settings;   // key=value, later ones win
  std::filesystem::path model;         // .tflite, "builtin" or "none"; empty: chosen by the source
  std::filesystem::path materials;     // .toml; empty: the built-in table
  std::string app = "none";            // none | shooting | plates
  std::filesystem::path script;        // of the app
  std::string collision = "semantic";  // none | uniform | semantic
  std::string display = "none";        // none | window
  std::string gravity;                 // "x,y,z" in the first depth frame; empty: found out
  FrameRange frames;
  std::filesystem::path record;  // .tac; empty: not recorded
  std::string record_color = "as-came";  // as-came | jpeg
  std::filesystem::path faults;  // .toml; empty: the cameras are left alone
  bool is_json = false;          // summary.json on standard output
  std::string command;   // the whole command line, for the report
};

/// `tactus eval trajectory`.
struct EvalTrajectoryOptions {
  std::filesystem::path estimate, truth;
  double gap_ms_max = 20;
  bool is_json = false;
};

/// `tactus eval surface`.
struct EvalSurfaceOptions {
  std::filesystem::path mesh;
  std::string truth;                  // .ply, folder with mesh.ply, or synthetic:NAME
  std::string align = "auto";         // auto | rigid | first | none
  std::filesystem::path poses;        // of the estimate; empty: trajectory.txt beside the mesh
  std::filesystem::path truth_poses;  // empty: groundtruth.txt beside the true mesh, or the room's own
  std::size_t samples_count = 200'000;
  bool is_json = false;
};

/// `tactus eval labels`.
struct EvalLabelsOptions {
  std::string source;
  std::filesystem::path truth;             // folder of label images; empty: the source's own
  std::filesystem::path save_predictions;  // folder; empty: nothing is written
  std::filesystem::path save_points;       // file; empty: nothing is written
  std::filesystem::path model;             // .tflite; empty: as `tactus run` chooses a network
  std::string profile = "x86";
  std::vector<std::string> settings;
  std::string gravity;
  FrameRange frames;
  std::string crf = "default";  // of the 3D CRF: default | paper | FILE.toml
  std::uint64_t every = 0;      // of the frames with truth; 0: chosen by how many there are
  bool has_confusion = false;   // the tables of what was taken for what
  bool is_json = false;
};

/// `tactus study accuracy | errors | keyframes`.
struct StudyOptions {
  std::filesystem::path out;    // folder for pictures and JSON; empty: nothing is written
  std::filesystem::path data;   // folder of recordings; empty: looked for beside
  std::filesystem::path model;  // .tflite; empty: as `tactus run` chooses a network
  std::string profile = "x86";
  std::vector<std::string> settings;
  std::string crf = "default";                             // of the 3D CRF: default | paper | FILE.toml
  std::string mode = "640x480";                            // of the synthetic rooms
  int frames_count = 300;                                  // of each synthetic room
  std::vector<std::string> rooms = {"bedroom", "office"};  // the synthetic ones, or none
  int views_count = 0;  // frames scored of each synthetic room; 0: the paper's 13 and 12
  bool is_json = false;
  std::string command;  // the whole command line, for the report
};

/// `tactus study stats`.
struct StudyStatsOptions {
  std::filesystem::path ratings;  // firmware_host/ratings_file.hpp says what is in it
  std::filesystem::path out;      // folder for stats.json and ratings.svg; empty: nothing is written
  bool is_json = false;
};

/// `tactus study form`.
struct StudyFormOptions {
  std::filesystem::path clips;  // folder of *.mp4, one per condition
  std::filesystem::path out;    // .html
  std::string title = "Virtual things in a real room";
  double min_view_s = 10;    // a clip can be rated once it has played for so long
  bool is_embedded = false;  // the clips are in the page
};

/// `tactus study clips`. Of `run`, runner, collision and display are set by the study.
struct StudyClipsOptions {
  RunOptions run;
  StudyClipsOptions() {
    run.source = "synthetic:bedroom";
    run.app = "plates";
  }
};

/// `tactus study plausibility`.
struct StudyPlausibilityOptions {
  std::vector<std::string> rooms = {"bedroom", "office"};
  int throws_count = 40;            // in each room
  int frames_count = 300;           // of each room
  std::string mode = "320x240";     // of their cameras
  std::string labels = "network";   // network | truth
  std::uint64_t seed = 1;           // of the throws
  std::filesystem::path out;        // folder for plausibility.json; empty: nothing is written
  std::filesystem::path model, materials;
  std::string profile = "x86";
  std::vector<std::string> settings;
  bool is_json = false;
  std::string command;  // the whole command line, for the report
};

/// `tactus convert`.
struct ConvertOptions {
  std::string source;
  std::filesystem::path out;
  FrameRange frames;
  std::string layout;          // tum | 7scenes | tac | oni; empty: by the ending of `out`, else tum
  std::string color;           // folders: jpeg | png, tac: as-came | jpeg; empty: jpeg, as-came
  bool has_labels = true;
  std::string command;         // the whole command line, for the file
};

/// `tactus record`.
struct RecordOptions {
  std::string source;
  std::filesystem::path out;
  FrameRange frames;
  double seconds = 0;             // on the device's clock; 0: until the source ends or SIGINT
  std::string color = "as-came";  // as-came | jpeg
  int jpeg_quality = 95;
  bool is_json = false;
  std::string command;            // the whole command line, for the file
};

/// `tactus devices`.
struct DevicesOptions {
  bool is_json = false;
};

/// `tactus info`.
struct InfoOptions {
  std::string source;
  FrameRange frames;
  bool is_quick = false;             // reads no frames
  bool checks_registration = false;  // whether depth lies on colour, instead of the rest
  int pairs_max = 60;                // of frames looked at for it
  bool is_json = false;
};

/// `tactus query`.
struct QueryOptions {
  std::filesystem::path map;       // file, or folder of a run
  std::optional<std::string> at;   // X,Y,Z in metres
  std::optional<std::string> ray;  // origin and direction
  float range_m = 10;
  std::string set;        // material that the surface found is pinned to
  bool is_unset = false;  // a pin is taken back
  float within_m = 0;     // as map::SurfacePin
  std::filesystem::path out;
  bool is_json = false;
};

/// `tactus plan`.
struct PlanOptions {
  std::string source;  // whose cameras set the sizes; empty: 640x480 with registered colour
  std::string profile = "x86";
  std::vector<std::string> settings;
  bool is_json = false;
};

/// `tactus wiring`.
struct WiringOptions {
  bool is_dot = false;  // Graphviz instead of text
};

/// `tactus bench`.
struct BenchOptions {
  int frames_count = 120;
  std::uint32_t blocks_capacity = 0;  // of the map's pool; 0: the x86 profile's
  bool is_json = false;
  std::string command;  // the whole command line, for the report
};

}  // namespace tactus::firmware
