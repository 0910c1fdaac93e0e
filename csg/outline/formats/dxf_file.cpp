#include "csg/outline/formats/dxf_file.h"

#include <charconv>
#include <cmath>

#include "mesh/text/text_scanner.h"

namespace strata::csg {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n\f\v";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

/// Reads groups. A group is two lines: a code and a value.
class Groups {
 public:
  Groups(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  /// The next group; code -1 at the end.
  Result<DxfGroup> next() {
    std::string_view code;
    if (!read_line(code)) return DxfGroup{-1, {}, line_};
    if (code.empty() && trimmed(text_).empty()) return DxfGroup{-1, {}, line_};
    DxfGroup group;
    const auto [end, error] = std::from_chars(code.data(), code.data() + code.size(), group.code);
    if (error != std::errc{} || end != code.data() + code.size()) {
      return fail(ErrorCode::kInput, "{}:{}: '{}' is not a group code", name_, line_,
                  std::string(code.substr(0, 40)));
    }
    if (!read_line(group.value)) {
      return fail(ErrorCode::kInput, "{}:{}: group code {} has no value", name_, line_, group.code);
    }
    group.line = line_;
    return group;
  }

 private:
  bool read_line(std::string_view& line) {
    if (text_.empty()) return false;
    const std::size_t end = text_.find('\n');
    line = trimmed(text_.substr(0, end));
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    ++line_;
    return true;
  }

  std::string_view text_;
  const std::string& name_;
  std::uint32_t line_ = 0;
};

/// Sorts groups into entities and blocks.
class Parser {
 public:
  Parser(std::string_view text, const std::string& name) : groups_(text, name), name_(name) {}

  Result<DxfFile> run(const std::stop_token& stop) {
    while (true) {
      if (stop.stop_requested()) return fail(ErrorCode::kCancelled, "stopped");
      auto group = groups_.next();
      if (!group) return tl::unexpected(group.error());
      if (group->code < 0) break;
      if (group->code == 0) {
        if (auto done = begin(*group); !done) return tl::unexpected(done.error());
        if (group->value == "EOF") break;
      } else if (auto done = add(*group); !done) {
        return tl::unexpected(done.error());
      }
    }
    return std::move(file_);
  }

 private:
  enum class Section { kOther, kEntities, kBlocks };

  /// Group 0 begins an entity, block or section.
  Result<void> begin(const DxfGroup& group) {
    const std::string_view type = group.value;
    entity_ = nullptr;
    awaits_name_ = false;
    in_block_head_ = false;
    if (type == "SECTION") {
      section_ = Section::kOther;
      awaits_name_ = true;
      polyline_ = nullptr;
    } else if (type == "ENDSEC") {
      section_ = Section::kOther;
      block_ = nullptr;
    } else if (section_ == Section::kBlocks && type == "BLOCK") {
      head_ = DxfBlock{};
      block_ = nullptr;
      in_block_head_ = true;
    } else if (section_ == Section::kBlocks && type == "ENDBLK") {
      block_ = nullptr;
      polyline_ = nullptr;
    } else if (section_ != Section::kOther) {
      auto* list = section_ == Section::kEntities ? &file_.entities
                   : block_ != nullptr            ? &block_->entities
                                                  : nullptr;
      if (list == nullptr) return {};
      if (type == "VERTEX" && polyline_ != nullptr) {
        entity_ = &polyline_->parts.emplace_back();
      } else {
        entity_ = &list->emplace_back();
        polyline_ = type == "POLYLINE" ? entity_ : nullptr;
      }
      entity_->type = type;
      entity_->line = group.line;
    }
    return {};
  }

  Result<void> add(const DxfGroup& group) {
    if (awaits_name_ && group.code == 2) {
      section_ = group.value == "ENTITIES" ? Section::kEntities
                 : group.value == "BLOCKS" ? Section::kBlocks
                                           : Section::kOther;
      awaits_name_ = false;
    } else if (in_block_head_) {
      if (group.code == 2) {
        block_ = &file_.blocks[std::string(group.value)];
        *block_ = head_;
      } else if (group.code == 10 || group.code == 20) {
        const auto number = dxf_number(group, name_);
        if (!number) return tl::unexpected(number.error());
        (block_ != nullptr ? block_->base : head_.base)[group.code == 10 ? 0 : 1] = *number;
      }
    } else if (entity_ != nullptr) {
      if (group.code == 8) entity_->layer = group.value;
      entity_->groups.push_back(group);
    }
    return {};
  }

  Groups groups_;
  const std::string& name_;
  DxfFile file_;
  Section section_ = Section::kOther;
  bool awaits_name_ = false, in_block_head_ = false;
  DxfBlock head_;
  DxfBlock* block_ = nullptr;
  DxfEntity* entity_ = nullptr;
  DxfEntity* polyline_ = nullptr;  ///< the POLYLINE whose VERTEX entities follow
};

}  // namespace

Result<double> dxf_number(const DxfGroup& group, const std::string& name) {
  std::string_view text = group.value;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  constexpr double kLargest = 1e100;
  if (error != std::errc{} || end != text.data() + text.size() || !(std::abs(value) < kLargest)) {
    return fail(ErrorCode::kInput, "{}:{}: '{}' of group {} is not a number", name, group.line,
                std::string(group.value.substr(0, 40)), group.code);
  }
  return value;
}

Result<DxfFile> parse_dxf(std::string_view text, const std::string& name,
                          const std::stop_token& stop) {
  if (text.starts_with("AutoCAD Binary DXF")) {
    return fail(ErrorCode::kInput, "{}: binary DXF is not read; save it as text", name);
  }
  if (detail::is_wide_text(text)) {
    return fail(ErrorCode::kInput, "{}: {}", name, detail::kWideText);
  }
  return Parser(detail::without_byte_order_mark(text), name).run(stop);
}

}  // namespace strata::csg
