#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "strata/core/result.h"

/// The text of a `.csg` file as a tree of calls. Parsing evaluates nothing and does not recurse.
/// Nodes and values lie in preorder in flat arrays; each has the index after its last descendant.
namespace strata::csg {

enum class ValueKind : std::uint8_t { kUndef, kBool, kNumber, kString, kList };

/// One value. The elements of a list follow it.
struct AstValue {
  double number = 0.0;    ///< value of a number; 0 or 1 for a bool
  std::uint32_t end = 0;  ///< list: index after the last element; string: index into strings
  ValueKind kind = ValueKind::kUndef;
};

struct AstArgument {
  std::string_view name;  ///< empty: given by position
  std::uint32_t value = 0;
};

/// A call `name(arguments) { children }`.
struct AstNode {
  static constexpr std::uint8_t kBackground = 1;  ///< %
  static constexpr std::uint8_t kHighlight = 2;   ///< #
  static constexpr std::uint8_t kRoot = 4;        ///< !
  static constexpr std::uint8_t kDisabled = 8;    ///< *

  std::string_view name;
  std::uint32_t offset = 0;    ///< offset of the name in the text
  std::uint32_t text_end = 0;  ///< offset after the last character of the subtree
  std::uint32_t first_argument = 0;
  std::uint32_t argument_count = 0;
  std::uint32_t end = 0;  ///< index after the last descendant
  std::uint8_t modifiers = 0;
};

/// A parsed file. Borrows the text, which must outlive it.
struct Ast {
  std::string_view text;
  std::string name;  ///< name of the file, for messages
  std::vector<AstNode> nodes;
  std::vector<AstArgument> arguments;
  std::vector<AstValue> values;
  std::vector<std::string> strings;
  std::vector<std::uint32_t> line_starts;  ///< offsets in the text

  /// `file:line:column` for an offset. Lines and columns count from 1; columns are bytes.
  [[nodiscard]] std::string place(std::uint32_t offset) const;
};

/// A reference to a value of a file, or to none.
class ValueRef {
 public:
  ValueRef() = default;
  ValueRef(const Ast& ast, std::uint32_t index) : ast_(&ast), index_(index) {}

  /// Whether the value is given and is not `undef`.
  [[nodiscard]] bool given() const { return ast_ && kind() != ValueKind::kUndef; }
  [[nodiscard]] bool is_number() const { return ast_ && kind() == ValueKind::kNumber; }
  [[nodiscard]] bool is_list() const { return ast_ && kind() == ValueKind::kList; }
  [[nodiscard]] bool is_string() const { return ast_ && kind() == ValueKind::kString; }
  [[nodiscard]] double number(double otherwise) const;
  [[nodiscard]] bool truth(bool otherwise) const;  ///< a bool, or a number != 0
  [[nodiscard]] std::string string(std::string_view otherwise = {}) const;

  /// Iterates over the elements of a list in order. Any other value has no elements.
  class Iterator {
   public:
    Iterator(const Ast* ast, std::uint32_t index) : ast_(ast), index_(index) {}
    ValueRef operator*() const { return {*ast_, index_}; }
    Iterator& operator++();
    bool operator!=(const Iterator& other) const { return index_ != other.index_; }

   private:
    const Ast* ast_;
    std::uint32_t index_;
  };
  [[nodiscard]] Iterator begin() const { return {ast_, is_list() ? index_ + 1 : 0}; }
  [[nodiscard]] Iterator end() const { return {ast_, is_list() ? value().end : 0}; }

  /// The value as it is written, shortened to some 60 characters, for messages.
  [[nodiscard]] std::string shown() const;

  /// Reads numbers into out[0..count) until the list ends or an element is not a number. @return
  /// how many were read
  std::size_t numbers(double* out, std::size_t count) const;

 private:
  [[nodiscard]] const AstValue& value() const { return ast_->values[index_]; }
  [[nodiscard]] ValueKind kind() const { return value().kind; }
  const Ast* ast_ = nullptr;
  std::uint32_t index_ = 0;
};

/// Parses the text of a `.csg` file of any dialect, with modifiers, comments and stray semicolons.
/// Unknown names are not errors here. Time and memory are linear in the length of the text,
/// whatever its nesting. Messages call the file `name`.
/// @return kInput `name:line:column: ...`; kLimit for 4 GiB or more of text
Result<Ast> parse_csg(std::string_view text, const std::string& name);

}  // namespace strata::csg
