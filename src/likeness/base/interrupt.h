// Ctrl-C as a request: long work ends after the item it is at, with its files whole, and says how to go on.

#pragma once

namespace likeness {

// While one exists, the first SIGINT or SIGTERM only sets a flag; the second ends the program at once. One at a time.
class InterruptScope {
 public:
  InterruptScope();
  ~InterruptScope();
  InterruptScope(const InterruptScope&) = delete;
  InterruptScope& operator=(const InterruptScope&) = delete;

  bool Requested() const;
};

}  // namespace likeness
