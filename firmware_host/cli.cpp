#include "firmware_host/cli.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>

#include "firmware_host/commands.hpp"
#include "firmware_host/machine.hpp"
#include "firmware_host/open_source.hpp"
#include "pipeline/label/material.hpp"

namespace tactus::firmware {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 done, 1 failed, 2 bad usage or configuration, 3 bad input data, 4 device unavailable,\n"
    "5 budget exceeded.";

/// What was chosen: the command to run once parsing is over.
using Command = std::function<rt::Result<std::string>()>;

/// --frames is read as text, so that what is wrong with it is told in our words.
void add_frames(CLI::App& app, FrameRange& range) {
  app.add_option_function<std::string>(
         "--frames",
         [&range](const std::string& text) {
           auto parsed = parse_frame_range(text);
           if (!parsed) throw CLI::ValidationError(parsed.error().message);
           range = *parsed;
         },
         "Take frames A to B - 1 only (A:B, A: or :B)")
      ->type_name("A:B");
}

void add_json(CLI::App& app, bool& is_json) { app.add_flag("--json", is_json, "Print JSON instead of text"); }

void add_profile(CLI::App& app, std::string& profile, std::vector<std::string>& settings) {
  app.add_option("--profile", profile, "Sizes and budgets of the device: x86, headset, paper (960x540@30 with registered depth) or a TOML file")
      ->type_name("x86|headset|paper|FILE.toml")
      ->capture_default_str();
  app.add_option("--set", settings, "Overrides one value of the profile; may be repeated")
      ->type_name("KEY=VALUE")
      ->take_all()
      ->allow_extra_args(false);
}

void add_crf(CLI::App& app, std::string& crf) {
  app.add_option("--crf", crf,
                 "Parameters of the 3D CRF: the product's, those of the paper's authors, or a TOML file")
      ->type_name("default|paper|FILE.toml")
      ->capture_default_str();
}

void add_model(CLI::App& app, std::filesystem::path& model) {
  app.add_option("--model", model,
                 "Network that labels keyframes: a .tflite file, builtin, or none (default: the source's "
                 "exact labels where it has them, else builtin)")
      ->type_name("FILE.tflite|builtin|none")
      ->check(CLI::ExistingFile | CLI::IsMember({"builtin", "none"}));
}

void add_materials(CLI::App& app, std::filesystem::path& materials) {
  app.add_option("--materials", materials, "Table of materials (.toml) instead of the built-in one")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
}

void add_script(CLI::App& app, std::filesystem::path& script) {
  app.add_option("--script", script, "What is thrown and shot and who walks, when and where (TOML), instead of the app's own")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
}

void add_gravity(CLI::App& app, std::string& gravity) {
  app.add_option("--gravity", gravity,
                 "Direction of gravity in the first depth frame, when the source does not know it")
      ->type_name("X,Y,Z");
}

void add_run(CLI::App& root, const PipelineCommands& pipeline, RunOptions& o, Command& command) {
  CLI::App* app =
      root.add_subcommand("run", "Track the camera, map and label the room, let things bounce in it");
  app->footer(source_help());
  app->add_option("SOURCE", o.source, "Where frames come from (below)")->required()->type_name("");
  app->add_option("--out", o.out,
                  "Folder that receives trajectory.txt, mesh.ply, map.tactus, summary.json, trace.json, "
                  "report.html, events.jsonl")
      ->type_name("DIR");
  app->add_option("--runner", o.runner,
                  "realtime: threads and deadlines, late frames are dropped and counted; lockstep: "
                  "one order, no drops, the same bits every time")
      ->check(CLI::IsMember({"realtime", "lockstep"}))
      ->capture_default_str();
  add_profile(*app, o.profile, o.settings);
  add_model(*app, o.model);
  add_materials(*app, o.materials);
  app->add_option("--app", o.app,
                  "What happens in the room: balls (none), bullets, or plates; the games leave video.mp4 and sound.wav in --out")
      ->check(CLI::IsMember({"none", "shooting", "plates"}))
      ->capture_default_str();
  add_script(*app, o.script);
  app->add_option("--collision", o.collision,
                  "How real surfaces act on virtual things: not at all, all alike, or by material")
      ->check(CLI::IsMember({"none", "uniform", "semantic"}))
      ->capture_default_str();
  app->add_option("--display", o.display, "Show the view in a window; H there names the keys")
      ->check(CLI::IsMember({"none", "window"}))
      ->capture_default_str();
  add_gravity(*app, o.gravity);
  add_frames(*app, o.frames);
  app->add_option("--record", o.record, "Also write every frame as it came into this file, to be played again (.tac)")
      ->type_name("FILE");
  app->add_option("--record-color", o.record_color, "Colour in it: as the camera gave it, or as JPEG")
      ->check(CLI::IsMember({"as-came", "jpeg"}))
      ->capture_default_str();
  app->add_option("--faults", o.faults,
                  "Faults of the cameras on purpose (TOML): lost, doubled, late, half frames, a clock that jumps, a plug that is "
                  "pulled")
      ->type_name("FILE.toml")
      ->check(CLI::ExistingFile);
  app->add_flag("--json", o.is_json, "Print summary.json to standard output");
  app->callback([&] { command = [&] { return pipeline.run(o); }; });
}

void add_eval_labels(CLI::App& eval, const PipelineCommands& pipeline, EvalLabelsOptions& o,
                     Command& command) {
  CLI::App* app = eval.add_subcommand(
      "labels", "Run a source and score its material labels: network, network + 2D CRF, map, map + 3D CRF");
  app->footer(
      "Truth is one 8-bit PNG of material ids per colour frame, named as it, 255 where unlabelled. The "
      "methods "
      "of the\n"
      "map are its dense ray-cast from the frame's tracked pose once the recording is over; 255, where the "
      "map "
      "has no\n"
      "surface or no label, is a miss. Classes without a pixel of truth are in no mean.\n" +
      std::string(source_help()));
  app->add_option("SOURCE", o.source, "What to run (below)")->required()->type_name("");
  app->add_option("--truth", o.truth, "Folder of true labels; else the source's own exact ones")
      ->type_name("DIR");
  app->add_option("--save-predictions", o.save_predictions,
                  "Folder that receives METHOD/NAME.png, 8-bit material ids, 255 where nothing is known")
      ->type_name("DIR");
  app->add_option("--save-points", o.save_points,
                  "File that receives the map's cells with unary costs and true labels, for fitting a CRF")
      ->type_name("FILE");
  app->add_option("--model", o.model, "Network that labels keyframes (.tflite)")->type_name("FILE");
  add_crf(*app, o.crf);
  add_profile(*app, o.profile, o.settings);
  add_gravity(*app, o.gravity);
  app->add_option(
         "--every", o.every,
         "Score the first frame with truth and every Nth after it (default 12, or 1 when there are at "
         "most 24 images)")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000));
  app->add_flag("--confusion", o.has_confusion, "Print what each material was taken for");
  add_frames(*app, o.frames);
  add_json(*app, o.is_json);
  app->callback([&] { command = [&] { return pipeline.eval_labels(o); }; });
}

void add_eval(CLI::App& root, const PipelineCommands& pipeline, EvalTrajectoryOptions& t,
              EvalSurfaceOptions& s, EvalLabelsOptions& l, Command& command) {
  CLI::App* eval = root.add_subcommand("eval", "Measure a result against the truth");
  eval->require_subcommand(1);
  if (pipeline.eval_labels) add_eval_labels(*eval, pipeline, l, command);
  CLI::App* trajectory = eval->add_subcommand("trajectory",
                                              "Error of a camera path: ATE aligned at the first pose and "
                                              "rigidly (no scale), RPE per second and metre");
  trajectory->footer(
      "EST and GT are TUM text (time tx ty tz qx qy qz qw, camera to world), a folder with groundtruth.txt "
      "or\n"
      "trajectory.txt, or a 7-Scenes folder (frame i at i / 30 s).");
  trajectory->add_option("EST", t.estimate, "The estimated trajectory")->required()->type_name("");
  trajectory->add_option("GT", t.truth, "The true trajectory")->required()->type_name("");
  trajectory->add_option("--gap", t.gap_ms_max, "Poses are partners up to this far apart in time")
      ->type_name("MS")
      ->capture_default_str();
  add_json(*trajectory, t.is_json);
  trajectory->callback([&] { command = [&t] { return eval_trajectory(t); }; });

  CLI::App* surface = eval->add_subcommand(
      "surface", "Distance of a mesh from the true surface, and its labels where both have them");
  surface->footer(
      "Points are spread evenly over the area of MESH and measured to TRUTH. Worlds are aligned by the "
      "camera paths:\n"
      "trajectory.txt beside MESH, groundtruth.txt beside TRUTH (a synthetic room knows its own).");
  surface->add_option("MESH", s.mesh, "The reconstructed mesh (.ply)")->required()->type_name("");
  surface->add_option("TRUTH", s.truth, "The true mesh (.ply, or a folder with mesh.ply), or synthetic:NAME")
      ->required()
      ->type_name("");
  surface->add_option("--align", s.align, "auto is rigid where both paths are known, else none")
      ->check(CLI::IsMember({"auto", "rigid", "first", "none"}))
      ->capture_default_str();
  surface->add_option("--poses", s.poses, "The path that MESH was made with")->type_name("EST");
  surface->add_option("--truth-poses", s.truth_poses, "The true path, in the world of TRUTH")
      ->type_name("GT");
  surface->add_option("--samples", s.samples_count, "Points on MESH")->type_name("N")->capture_default_str();
  add_json(*surface, s.is_json);
  surface->callback([&] { command = [&s] { return eval_surface(s); }; });
}

CLI::App* add_study(CLI::App& root, const PipelineCommands& pipeline, StudyOptions& o,
                    StudyStatsOptions& stats, Command& command) {
  CLI::App* study = root.add_subcommand("study", "The paper's accuracy study, what explains its figures, and its user study");
  study->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, const auto& run) {
    CLI::App* app = study->add_subcommand(name, what);
    app->add_option("--out", o.out, "Folder that receives pictures and JSON")->type_name("DIR");
    app->add_option("--data", o.data,
                    "Folder that may hold bedroom_rendered, kitchen_7scenes, tum_fr1_rpy, hand_labels")
        ->type_name("DIR");
    app->add_option("--model", o.model, "Network that labels keyframes (.tflite)")->type_name("FILE");
    add_crf(*app, o.crf);
    app->add_option("--mode", o.mode, "Image size of the synthetic rooms")
        ->check(CLI::IsMember({"640x480", "960x540", "320x240"}))
        ->capture_default_str();
    app->add_option("--length", o.frames_count, "Frames of each synthetic room")
        ->type_name("N")
        ->check(CLI::Range(1, 100'000))
        ->capture_default_str();
    app->add_option("--room", o.rooms, "Only this synthetic room, or none of them; may be repeated")
        ->check(CLI::IsMember({"bedroom", "office", "none"}))
        ->take_all()
        ->allow_extra_args(false);
    app->add_option("--views", o.views_count,
                    "Frames scored of each synthetic room (default 13 and 12, as the paper)")
        ->type_name("N")
        ->check(CLI::Range(1, 1000));
    add_profile(*app, o.profile, o.settings);
    add_json(*app, o.is_json);
    app->callback([&command, &o, run] { command = [&o, run] { return run(o); }; });
  };
  add("accuracy", "The four metrics of network, 2D CRF, map and 3D CRF, beside the paper's table",
      pipeline.study_accuracy);
  add("errors", "What tracking, reconstruction, segmentation, fusion and ray-cast each cost in mean IU",
      pipeline.study_errors);
  add("keyframes",
      "Accuracy, processor time and label age when one frame in N is labelled, or frames by need",
      pipeline.study_keyframes);
  CLI::App* app = study->add_subcommand("stats", "What the ratings of a user study say: ANOVA with repeated measures");
  app->add_option("RATINGS", stats.ratings, "CSV with a line per participant (below)")->required()->type_name("");
  app->add_option("--out", stats.out, "Folder that receives stats.json and ratings.svg")->type_name("DIR");
  add_json(*app, stats.is_json);
  app->footer(
      "RATINGS starts with a line of column names: participant, confirmed (yes | no), and for each condition rating_NAME\n"
      "(1 to 10) and viewed_NAME_s (seconds); background_NAME splits the participants into groups; others are left alone.\n"
      "Left out, as in the paper: who has not confirmed, and who watched a clip for less than 10 s.");
  app->callback([&command, &stats, run = pipeline.study_stats] { command = [&stats, run] { return run(stats); }; });
  return study;
}

void add_study_form(CLI::App& study, const PipelineCommands& pipeline, StudyFormOptions& o,
                    Command& command) {
  CLI::App* app = study.add_subcommand(
      "form", "Write the user study's questionnaire: one web page that sends nothing anywhere");
  app->add_option("--clips", o.clips, "Folder of clips to be rated, one for each condition: NAME.mp4")
      ->required()
      ->type_name("DIR");
  app->add_option("--out", o.out, "The page")->required()->type_name("FILE.html");
  app->add_option("--title", o.title, "Its heading")->type_name("TEXT")->capture_default_str();
  app->add_option("--min-view-s", o.min_view_s,
                  "A clip can be rated once it has played for so long; `study stats` wants 10 s")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app->add_flag("--embed", o.is_embedded,
                "Put the clips into the page; else it plays the files where they are");
  app->footer(
      "Each participant gets a random number and with it one of the balanced orders of the clips (Williams "
      "1949). The page\n"
      "works from a disk and keeps the answers of all who use it; its CSV is what `tactus study stats` "
      "reads.");
  app->callback([&command, &o, run = pipeline.study_form] { command = [&o, run] { return run(o); }; });
}

void add_study_clips(CLI::App& study, const PipelineCommands& pipeline, StudyClipsOptions& o, Command& command) {
  CLI::App* app = study.add_subcommand(
      "clips", "Film one script under the three conditions of the user study: none.mp4, uniform.mp4, semantic.mp4");
  app->add_option("SOURCE", o.run.source, "Where frames come from (below)")->type_name("")->capture_default_str();
  app->add_option("--out", o.run.out, "Folder that receives the clips and clips.json")->required()->type_name("DIR");
  app->add_option("--app", o.run.app, "What is done where no script says it")
      ->check(CLI::IsMember({"shooting", "plates"}))
      ->capture_default_str();
  add_script(*app, o.run.script);
  add_profile(*app, o.run.profile, o.run.settings);
  add_model(*app, o.run.model);
  add_materials(*app, o.run.materials);
  add_gravity(*app, o.run.gravity);
  add_frames(*app, o.run.frames);
  add_json(*app, o.run.is_json);
  app->footer(
      "The source is played three times in lockstep, so that camera path, map, throws and shots are the same in each clip;\n"
      "only what real surfaces do differs. The clips have sound.\n" +
      std::string(source_help()));
  app->callback([&command, &o, run = pipeline.study_clips] { command = [&o, run] { return run(o); }; });
}

void add_study_plausibility(CLI::App& study, const PipelineCommands& pipeline, StudyPlausibilityOptions& o,
                            Command& command) {
  CLI::App* app = study.add_subcommand(
      "plausibility", "How often thrown things do what the true material would make them do, under the three conditions");
  app->add_option("--rooms", o.rooms, "Synthetic rooms")
      ->type_name("ROOM,...")
      ->delimiter(',')
      ->check(CLI::IsMember({"bedroom", "office"}))
      ->capture_default_str();
  app->add_option("--throws", o.throws_count, "Plates and glasses thrown in each room")
      ->type_name("N")
      ->check(CLI::Range(1, 250))
      ->capture_default_str();
  app->add_option("--length", o.frames_count, "Frames of each room")
      ->type_name("N")
      ->check(CLI::Range(90, 100'000))
      ->capture_default_str();
  app->add_option("--mode", o.mode, "Image size of the rooms")
      ->check(CLI::IsMember({"640x480", "960x540", "320x240"}))
      ->capture_default_str();
  app->add_option("--labels", o.labels, "Where labels come from: a network, as in the product, or the rooms' exact ones")
      ->check(CLI::IsMember({"network", "truth"}))
      ->capture_default_str();
  app->add_option("--seed", o.seed, "Of the throws")->type_name("N")->capture_default_str();
  app->add_option("--model", o.model, "Network instead of the built-in one (.tflite)")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  add_materials(*app, o.materials);
  add_profile(*app, o.profile, o.settings);
  app->add_option("--out", o.out, "Folder that receives plausibility.json")->type_name("DIR");
  add_json(*app, o.is_json);
  app->footer(
      "Each room is played once a condition, with the same throws. Judged is the first contact of each throw with a real\n"
      "surface: what happened against what the impact law says of the true material there, at the same speed. A throw that\n"
      "flies through a true surface that the map does not have counts as `through`, one that is stopped where nothing is is\n"
      "judged against `through`; one that met another virtual thing first is left out of all conditions. With --labels truth\n"
      "what is left is not the network's: surfaces that are not mapped or not labelled yet.");
  app->callback([&command, &o, run = pipeline.study_plausibility] { command = [&o, run] { return run(o); }; });
}

void add_record(CLI::App& root, const PipelineCommands& pipeline, RecordOptions& o, Command& command) {
  CLI::App* app = root.add_subcommand("record", "Write what a source delivers into one file, as it comes (Ctrl-C ends it)");
  app->footer(source_help());
  app->add_option("SOURCE", o.source, "Where frames come from (below)")->required()->type_name("");
  app->add_option("--out", o.out, "The file; it must not exist")->required()->type_name("FILE.tac");
  app->add_option("--seconds", o.seconds, "End after so long, on the device's clock")
      ->type_name("S")
      ->check(CLI::PositiveNumber);
  app->add_option("--color", o.color, "Colour as the device gives it, without loss, or as JPEG, a tenth of the size")
      ->check(CLI::IsMember({"as-came", "jpeg"}))
      ->capture_default_str();
  app->add_option("--quality", o.jpeg_quality, "Of JPEG")
      ->type_name("N")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  add_frames(*app, o.frames);
  add_json(*app, o.is_json);
  app->callback([&] { command = [&] { return pipeline.record(o); }; });
}

void add_devices(CLI::App& root, const PipelineCommands& pipeline, DevicesOptions& o, Command& command) {
  CLI::App* app =
      root.add_subcommand("devices", "List the cameras that each backend sees, with their formats, or why it sees none");
  add_json(*app, o.is_json);
  app->callback([&] { command = [&] { return pipeline.devices(o); }; });
}

void add_convert(CLI::App& root, ConvertOptions& o, Command& command) {
  CLI::App* app = root.add_subcommand(
      "convert", "Write a source as another kind of recording, with poses and labels where known");
  app->footer(
      "Depth keeps every value, but in 7-Scenes layout and .oni where its unit is not 1 mm (.oni: or 0.1 mm). .oni keeps no\n"
      "poses, labels, distortion or pose between the cameras.\n" +
      std::string(source_help()));
  app->add_option("IN", o.source, "What to read (SOURCE, below)")->required()->type_name("");
  app->add_option("OUT", o.out, "A file that does not exist (.tac, .oni), or a new or empty folder")
      ->required()
      ->type_name("");
  app->add_option("--layout", o.layout, "Kind of recording (default: by OUT's ending, else tum)")
      ->check(CLI::IsMember({"tum", "7scenes", "tac", "oni"}));
  app->add_option("--color", o.color,
                  "Encoding of colour: jpeg (default) or png in folders, as-came (default, no loss) or jpeg in .tac")
      ->check(CLI::IsMember({"jpeg", "png", "as-came"}));
  app->add_flag_callback(
      "--no-labels", [&o] { o.has_labels = false; }, "Leave the label images out");
  add_frames(*app, o.frames);
  app->callback([&] { command = [&o] { return convert(o); }; });
}

void add_info(CLI::App& root, InfoOptions& o, Command& command) {
  CLI::App* app =
      root.add_subcommand("info", "Say what a source is: sizes, rates, calibration, gaps, what truth it has");
  app->footer(source_help());
  app->add_option("SOURCE", o.source, "What to look at (below)")->required()->type_name("");
  auto* quick = app->add_flag("--quick", o.is_quick, "Do not read the frames");
  auto* check = app->add_flag("--check-registration", o.checks_registration,
                              "Measure instead how far the edges of depth lie from those of colour, in pixels");
  check->excludes(quick);
  app->add_option("--pairs", o.pairs_max, "Frames looked at for it, spread over the source")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000))
      ->needs(check)
      ->capture_default_str();
  add_frames(*app, o.frames);
  add_json(*app, o.is_json);
  app->callback([&] { command = [&o] { return info(o); }; });
}

std::string material_names() {
  std::string names;
  for (const std::string_view name : kMaterialNames) names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

void add_query(CLI::App& root, const PipelineCommands& pipeline, QueryOptions& o, Command& command) {
  CLI::App* app =
      root.add_subcommand("query", "Ask a finished map what a place is made of, and correct it by hand");
  app->footer(
      "Without --at or --ray the map as a whole is described. Metres, y up, as in mesh.ply.\nMaterials: " +
      material_names() + ".");
  app->add_option("MAP", o.map, "map.tactus of `tactus run --out DIR`, or DIR")->required()->type_name("");
  app->add_option("--at", o.at, "The surface nearest to this point")->type_name("X,Y,Z");
  app->add_option("--ray", o.ray, "The first surface along a ray: its origin and its direction")
      ->type_name("X,Y,Z,DX,DY,DZ");
  app->add_option("--range", o.range_m, "Length of the ray")
      ->type_name("METRES")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_option("--set", o.set,
                  "Pin the surface found, as far as it is connected and of one material, to this material, "
                  "whatever keyframes say")
      ->type_name("MATERIAL");
  app->add_flag("--unset", o.is_unset, "Take the pin of the surface found back");
  app->add_option("--within", o.within_m,
                  "With --set: all connected surface within this distance, whatever its material")
      ->type_name("METRES")
      ->check(CLI::PositiveNumber);
  app->add_option("--out", o.out, "File for the corrected map; else MAP is replaced")->type_name("FILE");
  add_json(*app, o.is_json);
  app->callback([&] { command = [&] { return pipeline.query(o); }; });
}

/// Library messages come with or without a full stop, some with line feeds.
std::string sentence(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text + ".";
}

int print_error(std::FILE* err, const rt::Error& error) {
  std::fprintf(err, "tactus: %s\n", error.message.c_str());
  return static_cast<int>(error.code);
}

}  // namespace

int run_command_line(int argc, const char* const* argv, const PipelineCommands& pipeline, std::FILE* out,
                     std::FILE* err) {
  CLI::App root("tactus turns a depth camera into a room that virtual things can touch.", "tactus");
  root.set_version_flag("--version", std::string("tactus ") + revision());
  root.footer(std::string(source_help()) + "\n" + kExitCodes);
  root.require_subcommand(0, 1);  // none is told below, in clearer words than the library's
  root.get_formatter()->column_width(34);

  Command command;
  RunOptions run_options;
  EvalTrajectoryOptions trajectory_options;
  EvalSurfaceOptions surface_options;
  EvalLabelsOptions labels_options;
  StudyOptions study_options;
  StudyStatsOptions study_stats_options;
  StudyFormOptions study_form_options;
  StudyClipsOptions study_clips_options;
  StudyPlausibilityOptions study_plausibility_options;
  ConvertOptions convert_options;
  InfoOptions info_options;
  RecordOptions record_options;
  DevicesOptions devices_options;
  QueryOptions query_options;
  PlanOptions plan_options;
  WiringOptions wiring_options;
  BenchOptions bench_options;
  for (int i = 0; i < argc; ++i) run_options.command += i == 0 ? "tactus" : std::string(" ") + argv[i];
  if (pipeline.run) add_run(root, pipeline, run_options, command);
  add_eval(root, pipeline, trajectory_options, surface_options, labels_options, command);
  study_options.command = run_options.command;
  study_clips_options.run.command = run_options.command;
  study_plausibility_options.command = run_options.command;
  if (pipeline.study_accuracy) {
    CLI::App* study = add_study(root, pipeline, study_options, study_stats_options, command);
    if (pipeline.study_form) add_study_form(*study, pipeline, study_form_options, command);
    if (pipeline.study_clips) add_study_clips(*study, pipeline, study_clips_options, command);
    if (pipeline.study_plausibility)
      add_study_plausibility(*study, pipeline, study_plausibility_options, command);
  }
  convert_options.command = record_options.command = run_options.command;
  if (pipeline.devices) add_devices(root, pipeline, devices_options, command);
  if (pipeline.record) add_record(root, pipeline, record_options, command);
  add_convert(root, convert_options, command);
  add_info(root, info_options, command);
  if (pipeline.query) add_query(root, pipeline, query_options, command);
  if (pipeline.plan) {
    CLI::App* app =
        root.add_subcommand("plan", "Print the memory table: what is planned, how much, for whom and why");
    app->add_option("SOURCE", plan_options.source, "Take the sizes of its cameras; else 640x480")
        ->type_name("");
    add_profile(*app, plan_options.profile, plan_options.settings);
    add_json(*app, plan_options.is_json);
    app->callback([&] { command = [&] { return pipeline.plan(plan_options); }; });
  }
  if (pipeline.wiring) {
    CLI::App* app = root.add_subcommand("wiring", "Print the stages, the edges between them and the threads");
    app->add_flag("--dot", wiring_options.is_dot, "As a graph for Graphviz");
    app->callback([&] { command = [&] { return pipeline.wiring(wiring_options); }; });
  }
  if (pipeline.bench) {
    CLI::App* app = root.add_subcommand("bench", "Measure the stages and, beside them, the machine");
    bench_options.command = run_options.command;
    app->add_option("--frames", bench_options.frames_count, "Frames of the synthetic room, 1.5 MB each")
        ->type_name("N")
        ->check(CLI::Range(20, 2000))
        ->capture_default_str();
    app->add_option("--blocks", bench_options.blocks_capacity,
                    "Blocks in the map's pool; else the x86 profile's")
        ->type_name("N")
        ->check(CLI::Range(8192, 32768));
    add_json(*app, bench_options.is_json);
    app->callback([&] { command = [&] { return pipeline.bench(bench_options); }; });
  }

  try {
    root.parse(argc, argv);
    if (!command)
      return print_error(err, {rt::ExitCode::bad_usage, "no command was given. Try tactus --help."});
    const auto text = command();
    if (!text) return print_error(err, text.error());
    std::fwrite(text->data(), 1, text->size(), out);
    if (std::fflush(out) != 0)
      return print_error(err, {rt::ExitCode::failed, "standard output cannot be written."});
    return static_cast<int>(rt::ExitCode::done);
  } catch (const CLI::CallForHelp&) {
    // The help of the command that was asked about.
    const CLI::App* app = &root;
    std::string path;
    while (!app->get_subcommands().empty()) {
      path += (path.empty() ? "" : " ") + app->get_name();
      app = app->get_subcommands().front();
    }
    std::fputs(app->help(path).c_str(), out);
    return static_cast<int>(rt::ExitCode::done);
  } catch (const CLI::CallForVersion&) {
    std::fprintf(out, "tactus %s\n", revision());
    return static_cast<int>(rt::ExitCode::done);
  } catch (const CLI::ParseError& e) {
    return print_error(err, {rt::ExitCode::bad_usage, sentence(e.what()) + " Try tactus --help."});
  } catch (const std::exception& e) {
    return print_error(err, {rt::ExitCode::failed, std::string("a library failed: ") + e.what()});
  }
}

}  // namespace tactus::firmware
