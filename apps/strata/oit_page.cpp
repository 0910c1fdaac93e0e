#include "apps/strata/oit_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/markup.h"
#include "core/printable.h"

namespace strata::apps {
namespace {

/// Half a step of 8 bits: smaller differences are not seen.
constexpr double kVisible = 0.5 / 255.0;
/// Colours of the heat map, from kVisible to 1 in equal steps of the logarithm.
constexpr std::array<glm::u8vec3, 6> kHeat{
    {{255, 243, 178}, {254, 204, 92}, {253, 141, 60}, {240, 59, 32}, {165, 0, 38}, {60, 0, 30}}};
constexpr glm::u8vec3 kNoDifference{238, 240, 243};

/// Where a difference lies on the scale, in [0, 1]. @pre it is above kVisible
double on_scale(double difference) {
  return std::clamp(std::log(difference / kVisible) / std::log(1.0 / kVisible), 0.0, 1.0);
}

constexpr const char* kStyle = R"(
:root { --ink: #1d2126; --soft: #5c6670; --line: #d8dde2; --paper: #fff; --band: #f5f7f9; --accent: #14577c; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.5 "Source Sans 3", "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; }
main { max-width: 1440px; margin: 0 auto; padding: 2rem clamp(1rem, 3vw, 2.5rem) 4rem; }
h1 { font-size: clamp(1.6rem, 4vw, 2.2rem); line-height: 1.15; margin: 0 0 .4rem; letter-spacing: -.01em; }
h2 { font-size: 1.3rem; margin: 2.6rem 0 .6rem; }
h3 { font-size: 1.05rem; margin: 0; }
p { margin: .3rem 0; max-width: 72ch; }
.soft, figcaption, dt { color: var(--soft); }
img { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 3px; }
.reference { display: grid; grid-template-columns: minmax(0, 512px) minmax(0, 1fr); gap: 1.5rem; align-items: start; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1rem; margin: 0; }
dd { margin: 0; overflow-wrap: anywhere; }
figure { margin: 0; }
figcaption { font-size: .85rem; margin-top: .3rem; }
.scale { margin: 1rem 0 .2rem; max-width: 30rem; }
.bar { height: .9rem; border-radius: 3px; border: 1px solid var(--line); print-color-adjust: exact;
  -webkit-print-color-adjust: exact; }
.ticks { position: relative; height: 1.5rem; font-size: .8rem; color: var(--soft); }
.ticks span { position: absolute; transform: translateX(-50%); white-space: nowrap; }
.ticks span:first-child { transform: none; } .ticks span:last-child { transform: translateX(-100%); }
.table { overflow-x: auto; border: 1px solid var(--line); border-radius: 4px; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { padding: .4rem .6rem; text-align: right; vertical-align: top; border-bottom: 1px solid var(--line); }
tbody tr:last-child > * { border-bottom: 0; }
tbody tr:nth-child(even) > * { background: var(--band); }
thead th { background: var(--paper); vertical-align: bottom; border-bottom: 2px solid var(--ink); font-weight: 600; }
.text { text-align: left; }
td.long { min-width: 10.5rem; }
tbody th { text-align: left; font-weight: 600; white-space: nowrap; background: var(--paper); position: sticky; left: 0; }
thead th:first-child { position: sticky; left: 0; text-align: left; z-index: 1; }
a { color: var(--accent); text-decoration-thickness: 1px; text-underline-offset: 2px; }
th[tabindex] { cursor: pointer; }
th[tabindex]:focus-visible { outline: 2px solid var(--accent); outline-offset: -2px; }
th[aria-sort="ascending"]::after { content: " \25B2"; font-size: .7em; }
th[aria-sort="descending"]::after { content: " \25BC"; font-size: .7em; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 26rem), 1fr)); gap: 1.2rem; }
.card { border: 1px solid var(--line); border-radius: 4px; padding: .9rem; break-inside: avoid; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: .6rem; margin: .6rem 0; }
.card dl { font-size: .88rem; }
@media (max-width: 700px) {
  .reference { grid-template-columns: 1fr; }
  tbody th { white-space: normal; min-width: 7rem; max-width: 8.5rem; overflow-wrap: anywhere; }
}
@media print {
  @page { size: A4 landscape; margin: 12mm; }
  body { font-size: 9pt; }
  main { max-width: none; padding: 0; }
  .table { overflow: visible; border: 0; }
  table { font-size: 6.3pt; } th, td { padding: 1.2pt 2.5pt; }
  td.long, tbody th { min-width: 0; white-space: normal; position: static; }
  thead th:first-child { position: static; }
  thead { display: table-header-group; } tr { break-inside: avoid; } h2 { break-after: avoid; }
  .reference { grid-template-columns: 90mm 1fr; }
  .cards { grid-template-columns: repeat(4, 1fr); gap: 3mm; }
  .card { padding: 2mm; } .card p, .card dl, .card figcaption { font-size: 6.5pt; line-height: 1.35; }
  a { color: inherit; text-decoration: none; }
}
)";

/// Sorts the table by the column whose head is clicked; what was left out stays last.
constexpr const char* kScript = R"(
for (const head of document.querySelectorAll('thead th')) {
  head.tabIndex = 0;
  head.addEventListener('keydown', event => {
    if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); head.click(); }
  });
  head.addEventListener('click', () => {
    const down = head.getAttribute('aria-sort') === 'ascending';
    for (const other of head.parentNode.children) other.removeAttribute('aria-sort');
    head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
    const column = head.cellIndex, body = document.querySelector('tbody');
    const value = row => { const cell = row.cells[column]; return cell ? cell.dataset.v ?? cell.textContent : ''; };
    const numbers = !head.classList.contains('text') && column > 0;
    const rows = [...body.rows].sort((a, b) => {
      const last = a.classList.contains('out') - b.classList.contains('out');
      if (last) return last;
      const order = numbers ? value(a) - value(b) : value(a).localeCompare(value(b));
      return down ? -order : order;
    });
    body.append(...rows);
  });
}
)";

std::string escaped(std::string_view text) { return escape_markup(printable(text)); }

std::string data_uri(const std::vector<std::uint8_t>& png) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out = "data:image/png;base64,";
  out.reserve(out.size() + (png.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < png.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, png.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? png[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
    }
  }
  return out;
}

std::string picture(const std::vector<std::uint8_t>& png, const OitCommand& command,
                    const std::string& what) {
  return fmt::format("<img src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}\">", data_uri(png),
                     command.size.x, command.size.y, escaped(what));
}

/// "1 234 567"
std::string page_number(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, "\u202f");
  return text;
}

std::string full_name(const OitResult& result) {
  const auto& [technique, settings] = result.choice->chosen;
  std::string name(technique->name);
  if (settings.k != 0 && !technique->k_means.empty()) name += fmt::format(":{}", settings.k);
  const std::string_view usual = technique->variants.substr(0, technique->variants.find(' '));
  if (settings.variant != usual) name += ":" + settings.variant;
  return name;
}

std::string psnr_text(const OitResult& result) {
  return std::isfinite(result.difference.psnr) ? fmt::format("{:.1f}", result.difference.psnr)
                                               : std::string("\u221e");
}

struct Column {
  const char* head;
  bool text = false;
};
constexpr Column kColumns[] = {{"Technique"},
                               {"Class", true},
                               {"PSNR, dB"},
                               {"Largest error"},
                               {"Pixels that differ"},
                               {"Passes"},
                               {"Fragments kept"},
                               {"Lost"},
                               {"Merged"},
                               {"Bytes by formula"},
                               {"Bytes allocated"},
                               {"Time, ms"},
                               {"Where it fails", true},
                               {"Paper", true}};

std::string number_cell(double value, const std::string& shown) {
  return fmt::format("<td data-v=\"{}\">{}</td>", value, shown);
}

std::string row(const OitResult& result, std::size_t index) {
  const transparency::Technique& technique = *result.choice->chosen.technique;
  const std::string head = fmt::format("<th scope=\"row\"><a href=\"#t{}\">{}</a></th>", index,
                                       escaped(full_name(result)));
  if (!result.left_out.empty()) {
    return fmt::format(
        "<tr class=\"out\">{}<td class=\"text\">{}</td><td class=\"text\" colspan=\"{}\">Left out: "
        "{}</td></tr>\n",
        head, accuracy_word(technique.accuracy), std::size(kColumns) - 2, escaped(result.left_out));
  }
  const transparency::Costs& costs = result.costs;
  const transparency::Difference& d = result.difference;
  std::string text =
      fmt::format("<tr>{}<td class=\"text\">{}</td>", head, accuracy_word(technique.accuracy));
  text += number_cell(std::isfinite(d.psnr) ? d.psnr : 1e9, psnr_text(result));
  text += number_cell(d.largest, d.largest > 0.0 ? fmt::format("{:.2g}", d.largest) : "0");
  for (const std::uint64_t count : {d.pixels, costs.geometry_passes, costs.kept, costs.lost,
                                    costs.merged, costs.formula_bytes, costs.allocated_bytes}) {
    text += number_cell(static_cast<double>(count), page_number(count));
  }
  text += number_cell(1000 * result.seconds, fmt::format("{:.1f}", 1000 * result.seconds));
  return text + fmt::format("<td class=\"text long\">{}</td><td class=\"text long\">{}</td></tr>\n",
                            escaped(technique.fails), escaped(technique.paper));
}

std::string table(const OitOutcome& outcome) {
  std::string text = "<div class=\"table\"><table>\n<thead><tr>";
  for (const Column& column : kColumns) {
    text += fmt::format("<th scope=\"col\"{}>{}</th>", column.text ? " class=\"text\"" : "",
                        column.head);
  }
  text += "</tr></thead>\n<tbody>\n";
  for (std::size_t i = 0; i < outcome.results.size(); ++i) text += row(outcome.results[i], i);
  return text + "</tbody>\n</table></div>\n";
}

std::string card(const OitCommand& command, const OitResult& result, std::size_t index) {
  const transparency::Technique& technique = *result.choice->chosen.technique;
  const std::string name = full_name(result);
  std::string text =
      fmt::format("<article class=\"card\" id=\"t{}\"><h3>{}</h3><p class=\"soft\">{}</p>\n", index,
                  escaped(name), escaped(technique.title));
  if (result.left_out.empty()) {
    text += fmt::format(
        "<div class=\"pair\"><figure>{}<figcaption>Picture</figcaption></figure>"
        "<figure>{}<figcaption>{}</figcaption></figure></div>\n",
        picture(result.picture, command, name),
        picture(result.heat, command, "differences of " + name),
        result.difference.largest > 0.0 ? fmt::format("Difference, {} dB, at most {:.2g}",
                                                      psnr_text(result), result.difference.largest)
                                        : std::string("No difference"));
  } else {
    text += fmt::format("<p>Left out: {}</p>\n", escaped(result.left_out));
  }
  text += "<dl>";
  const auto fact = [&](const char* topic, std::string_view what) {
    if (!what.empty()) text += fmt::format("<dt>{}</dt><dd>{}</dd>", topic, escaped(what));
  };
  fact("Paper", technique.paper);
  fact("Memory", technique.memory);
  fact("Fails", technique.fails);
  return text + "</dl></article>\n";
}

std::string scale() {
  std::string stops, ticks;
  for (std::size_t i = 0; i < kHeat.size(); ++i) {
    stops += fmt::format("{}rgb({} {} {})", i == 0 ? "" : ", ", kHeat[i].r, kHeat[i].g, kHeat[i].b);
  }
  constexpr std::pair<double, const char*> kTicks[] = {
      {kVisible, "0.002"}, {0.01, "0.01"}, {0.03, "0.03"}, {0.1, "0.1"}, {0.3, "0.3"}, {1.0, "1"}};
  for (const auto& [value, shown] : kTicks) {
    ticks += fmt::format("<span style=\"left: {:.1f}%\">{}</span>", 100 * on_scale(value), shown);
  }
  return fmt::format(
      "<div class=\"scale\"><div class=\"bar\" style=\"background: linear-gradient(to right, {})\">"
      "</div><div class=\"ticks\">{}</div></div>\n<p class=\"soft\">Heat maps show the largest "
      "difference of red, green, blue or alpha, from 0 to 1. Grey: less than half a step of 8 "
      "bits.</p>\n",
      stops, ticks);
}

std::string head(const OitCommand& command, const OitOutcome& outcome, int threads) {
  std::string files;
  for (const std::string& file : command.input.files) {
    files += (files.empty() ? "" : ", ") + escaped(file);
  }
  std::string text = fmt::format(
      "<h1>Transparency, technique by technique</h1>\n<p class=\"soft\">{}</p>\n", files);
  text += fmt::format(
      "<section class=\"reference\"><figure>{}<figcaption>The exact picture, by {}: all layers, "
      "sorted</figcaption></figure><div><dl>",
      picture(outcome.reference_picture, command, "the exact picture"), outcome.reference->name);
  const auto fact = [&](const char* topic, const std::string& what) {
    text += fmt::format("<dt>{}</dt><dd>{}</dd>", topic, what);
  };
  fact("Picture",
       fmt::format("{} \u00d7 {} pixels, {} a pixel", command.size.x, command.size.y,
                   counted(static_cast<std::uint64_t>(command.picture.samples), "sample")));
  fact("Scene", fmt::format("{}, {}", counted(outcome.objects, "object"),
                            counted(outcome.triangles, "triangle")));
  fact("Opacity", fmt::format("{:g} of what is opaque by itself", outcome.opacity));
  for (const OitResult& result : outcome.results) {
    if (!result.left_out.empty()) continue;
    fact("Fragments", fmt::format("{}, at most {} in a sample", page_number(result.costs.fragments),
                                  counted(result.costs.most_layers, "layer")));
    break;
  }
  fact("Times", fmt::format("median of {} after a warm-up, {}, fragments included", outcome.runs,
                            counted(static_cast<std::uint64_t>(threads), "thread")));
  fact("Strata", STRATA_VERSION);
  return text + "</dl>\n" + scale() + "</div></section>\n";
}

}  // namespace

csg::Picture heat_map(const transparency::Image& image, const transparency::Image& reference) {
  csg::Picture map{image.width, image.height, {}};
  map.pixels.reserve(image.pixels.size());
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const glm::vec4 by = glm::abs(image.pixels[i] - reference.pixels[i]);
    const double most = std::max({by.r, by.g, by.b, by.a});
    glm::vec3 colour(kNoDifference);
    if (most > kVisible) {
      const double at = on_scale(most) * static_cast<double>(kHeat.size() - 1);
      const auto below = std::min(static_cast<std::size_t>(at), kHeat.size() - 2);
      colour = glm::mix(glm::vec3(kHeat[below]), glm::vec3(kHeat[below + 1]),
                        static_cast<float>(at - static_cast<double>(below)));
    }
    map.pixels.emplace_back(glm::u8vec3(colour + 0.5f), 255);
  }
  return map;
}

std::string oit_page(const OitCommand& command, const OitOutcome& outcome, int threads) {
  std::string text = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta "
      "name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>Transparency, "
      "technique by technique</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n",
      kStyle);
  text += head(command, outcome, threads);
  text += "<h2>Techniques</h2>\n" + table(outcome);
  text += "<h2>Pictures and differences</h2>\n<div class=\"cards\">\n";
  for (std::size_t i = 0; i < outcome.results.size(); ++i) {
    text += card(command, outcome.results[i], i);
  }
  text += "</div>\n";
  return text + fmt::format("</main>\n<script>{}</script>\n</body>\n</html>\n", kScript);
}

}  // namespace strata::apps
