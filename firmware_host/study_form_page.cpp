#include "firmware_host/study_form_page.hpp"

namespace tactus::firmware {

// Colours are those of the report; light and dark follow the system.
const std::string_view kStudyFormStyle = R"css(
:root{color-scheme:light dark;--bg:#f7f6f3;--card:#fff;--ink:#1c1d1f;--soft:#5d6066;--rule:#d5d2cb;--accent:#1c64c4;
--on-accent:#fff;--bad:#b3261e;--track:#eceae5}
@media (prefers-color-scheme:dark){:root{--bg:#121316;--card:#1a1c20;--ink:#e9e9e7;--soft:#a6a9b0;--rule:#3a3e46;
--accent:#69a7ff;--on-accent:#0b1420;--bad:#ff8a80;--track:#2a2d33}}
*{box-sizing:border-box}
[hidden]{display:none!important}
body{margin:0;background:var(--bg);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","DejaVu Sans",sans-serif}
main{max-width:760px;margin:0 auto;padding:36px 20px 64px}
h1{font-size:28px;line-height:1.2;margin:0 0 20px;overflow-wrap:anywhere}
h2{font-size:19px;margin:0 0 12px}
p{margin:0 0 12px}.soft{color:var(--soft);font-size:14px}.bad{color:var(--bad)}
section,details{background:var(--card);border:1px solid var(--rule);border-radius:10px;padding:22px 24px;margin-top:18px}
fieldset{border:0;margin:0 0 14px;padding:0;min-width:0}legend{padding:0;margin-bottom:6px;font-weight:600}
fieldset:disabled{opacity:.45}
label{cursor:pointer}fieldset:disabled label{cursor:default}
.choice label{margin-right:22px}
.scale{display:grid;grid-template-columns:repeat(10,1fr);gap:4px;text-align:center}
.scale label{border:1px solid var(--rule);border-radius:6px;padding:6px 0}
.scale label:has(:checked){border-color:var(--accent);background:var(--track)}
.scale input{display:block;margin:0 auto 2px}
.ends{display:flex;justify-content:space-between;color:var(--soft);font-size:14px;margin-top:4px}
input{accent-color:var(--accent)}
video{display:block;width:100%;max-height:60vh;background:#000;border-radius:6px;margin-bottom:10px}
.watched{display:flex;align-items:center;gap:12px;margin-bottom:14px;font-size:14px;color:var(--soft);flex-wrap:wrap}
progress{width:140px;accent-color:var(--accent)}
textarea{width:100%;font:inherit;color:inherit;background:var(--bg);border:1px solid var(--rule);border-radius:6px;padding:8px}
textarea[readonly]{font:13px/1.5 ui-monospace,Menlo,Consolas,"DejaVu Sans Mono",monospace}
button{font:inherit;color:var(--ink);background:var(--track);border:1px solid var(--rule);border-radius:6px;padding:7px 16px;margin:0 8px 8px 0;cursor:pointer}
button.main{background:var(--accent);color:var(--on-accent);border-color:var(--accent);font-weight:600}
button:disabled{opacity:.45;cursor:default}
:focus-visible{outline:3px solid var(--accent);outline-offset:2px}h2:focus-visible{outline:0}
summary{cursor:pointer;color:var(--soft)}details p:first-of-type{margin-top:12px}
@media (max-width:520px){section,details{padding:16px}.scale{grid-template-columns:repeat(5,1fr)}}
)css";

const std::string_view kStudyFormScript = R"js(
"use strict";
const settings = JSON.parse(document.getElementById("settings").textContent);
const element = (id) => document.getElementById(id);
const names = settings.clips.map((clip) => clip.name);
const columns = ["participant", "confirmed", ...names.flatMap((name) => ["rating_" + name, "viewed_" + name + "_s"]),
                 ...settings.backgrounds.map((name) => "background_" + name), "order", "comment"];

// Another page with other clips on the same device keeps its answers apart. Every participant is an item of its own:
// pages that are open side by side see each other's writes late, and would lose some of a common one.
const key_start = "tactus study form " + JSON.stringify([settings.title, settings.min_view_s, settings.clips]) + " ";
let unsaved = [], storage_fails = false;
function keep(row) {
  const item = {finished_ms: Date.now(), row};
  try {
    localStorage.setItem(key_start + row[0], JSON.stringify(item));
  } catch {
    storage_fails = true;
    unsaved.push(item);
  }
}
function kept_keys() {
  try {
    return Object.keys(localStorage).filter((key) => key.startsWith(key_start));
  } catch {
    storage_fails = true;
    return [];
  }
}
function kept() {
  const items = [...unsaved];
  for (const key of kept_keys()) {
    try {
      const item = JSON.parse(localStorage.getItem(key));
      if (item.row.length !== columns.length) throw Error("not a row of this page");
      items.push(item);
    } catch {
      storage_fails = true;
    }
  }
  return items.sort((a, b) => a.finished_ms - b.finished_ms).map((item) => item.row);
}
function clear() {
  unsaved = [];
  for (const key of kept_keys()) localStorage.removeItem(key);
}

const quoted = (field) => /[",\r\n]|^\s|\s$/.test(field) ? '"' + field.replaceAll('"', '""') + '"' : field;
const csv = (rows) => [columns, ...rows].map((row) => row.map(quoted).join(",") + "\r\n").join("");
// A spreadsheet would take a comment that starts like this for a formula.
const harmless = (text) => /^[=+\-@\t\r]/.test(text) ? "'" + text : text;

// Balanced for order and for what follows what: Williams (1949), n rows for an even number of clips, 2 n for an odd one.
function orders(n) {
  const first = [0];
  for (let i = 1; i < n; ++i) first.push(i % 2 ? (i + 1) / 2 : n - i / 2);
  const rows = first.map((_, shift) => first.map((clip) => (clip + shift) % n));
  return n % 2 ? [...rows, ...rows.map((row) => [...row].reverse())] : rows;
}
const order_text = (order) => order.map((clip) => names[clip]).join(" > ");

// The number decides among the orders that this device has shown least often.
function new_participant() {
  const rows = kept();
  let number;
  do number = crypto.getRandomValues(new Uint32Array(1))[0];
  while (rows.some((row) => row[0] === id_of(number)));
  const shown = orders(names.length).map((order) => {
    return {order, times: rows.filter((row) => row[columns.indexOf("order")] === order_text(order)).length};
  });
  const least = Math.min(...shown.map((one) => one.times));
  const candidates = shown.filter((one) => one.times === least);
  return {id: id_of(number), order: candidates[number % candidates.length].order};
}
const id_of = (number) => "p" + number.toString(16).padStart(8, "0");

const participant = new_participant();
const form = element("form");
const sections = [...document.querySelectorAll("section.clip")];
const viewed_s = names.map(() => 0);
const shown_s = (seconds) => (Math.floor(seconds * 10) / 10).toFixed(1);  // never more than was watched
const chosen = (name) => form.elements[name].value;
const is_rated = (clip) => chosen("rating_" + clip) !== "";

// One after another: the questions, each clip once the one before is rated, the end.
function reveal() {
  let is_open = settings.backgrounds.every((name) => chosen("background_" + name) !== "");
  for (const clip of participant.order) {
    sections[clip].hidden = !is_open;
    is_open = is_open && is_rated(clip);
  }
  element("end").hidden = !is_open;
}

function watch(section, clip) {
  const video = section.querySelector("video"), scale = section.querySelector("fieldset");
  const said = section.querySelector(".said"), bar = section.querySelector("progress");
  let last_s = 0, is_playing = false;
  const say = () => {
    const is_enough = viewed_s[clip] >= settings.min_view_s;
    bar.value = Math.min(viewed_s[clip], settings.min_view_s);
    bar.hidden = is_enough;
    if (is_enough === scale.disabled || !is_enough)
      said.textContent = is_enough ? "You can rate this clip now, and watch it as often as you like."
                                   : "Watched " + shown_s(viewed_s[clip]) + " of " + settings.min_view_s + " s";
    scale.disabled = !is_enough;
  };
  // Seconds of the clip that passed while it played before the participant's eyes; a jump is none.
  video.addEventListener("timeupdate", () => {
    const now_s = video.currentTime;
    if (is_playing && !video.seeking && !document.hidden) viewed_s[clip] += Math.max(0, now_s - last_s);
    last_s = now_s;
    say();
  });
  video.addEventListener("seeking", () => { last_s = video.currentTime; });
  video.addEventListener("playing", () => { is_playing = true; last_s = video.currentTime; });
  for (const name of ["pause", "waiting", "ended"]) video.addEventListener(name, () => { is_playing = false; });
  video.addEventListener("play", () => {
    for (const other of document.querySelectorAll("video")) if (other !== video) other.pause();
  });
  // Everybody sees the clips at the same speed.
  video.addEventListener("ratechange", () => { if (video.playbackRate !== 1) video.playbackRate = 1; });
  video.addEventListener("error", () => {
    const failed = section.querySelector(".failed");
    failed.hidden = false;
    failed.textContent = "This clip cannot be played" +
        (video.src.startsWith("data:") ? " by this browser." : ": is " + video.getAttribute("src") + " where it was when this page was made?");
  });
  section.querySelector(".again").addEventListener("click", () => { video.currentTime = 0; video.play(); });
  say();
}

const row_of_answers = () => [
  participant.id, chosen("confirmed"), ...names.flatMap((_, clip) => [chosen("rating_" + clip), shown_s(viewed_s[clip])]),
  ...settings.backgrounds.map((name) => chosen("background_" + name)), order_text(participant.order),
  harmless(form.elements.comment.value.trim())];

function save(file_name, text) {
  const link = document.createElement("a");
  // Spreadsheets need the mark to see that it is UTF-8.
  link.href = URL.createObjectURL(new Blob(["\ufeff" + text], {type: "text/csv"}));
  link.download = file_name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

function say_kept() {
  const rows = kept();
  element("kept_count").textContent = rows.length === 1 ? "1 participant is kept in this browser."
                                                       : rows.length + " participants are kept in this browser.";
  element("storage_fails").hidden = !storage_fails;
  element("export").disabled = element("clear").disabled = rows.length === 0;
  element("sure").hidden = true;
}

let row = null;
element("start").addEventListener("click", () => {
  element("start").hidden = true;
  form.hidden = false;
  reveal();
  form.querySelector("input").focus();
});
form.addEventListener("change", reveal);
form.addEventListener("submit", (event) => {
  event.preventDefault();
  if (row !== null) return;
  row = row_of_answers();
  keep(row);
  for (const video of document.querySelectorAll("video")) video.pause();
  form.hidden = element("intro").hidden = true;
  element("done").hidden = false;
  element("line").value = csv([row]);
  element("thanks").focus();
  say_kept();
});
element("save").addEventListener("click", () => save("study_" + participant.id + ".csv", csv([row])));
element("next").addEventListener("click", () => location.reload());
element("export").addEventListener("click", () => save("study_ratings.csv", csv(kept())));
element("clear").addEventListener("click", () => { element("sure").hidden = false; element("no_clear").focus(); });
element("no_clear").addEventListener("click", say_kept);
element("yes_clear").addEventListener("click", () => { clear(); say_kept(); });
addEventListener("storage", say_kept);  // another window finished or cleared
// A started form is not lost by a slip; a finished one is kept.
addEventListener("beforeunload", (event) => { if (!form.hidden && row === null) event.preventDefault(); });

for (const [place, clip] of participant.order.entries()) {
  element("clips").append(sections[clip]);
  sections[clip].querySelector("h2").textContent = "Clip " + (place + 1) + " of " + names.length;
  watch(sections[clip], clip);
}
form.reset();
element("intro").hidden = false;
say_kept();
)js";

}  // namespace tactus::firmware
