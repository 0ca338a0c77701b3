#include "likeness/base/interrupt.h"

#include <csignal>

namespace likeness {
namespace {

volatile std::sig_atomic_t g_requested = 0;

// Handlers are installed with SA_RESETHAND: the next signal ends the program.
void Note(int) { g_requested = 1; }

}  // namespace

InterruptScope::InterruptScope() {
  g_requested = 0;
  struct sigaction action = {};
  action.sa_handler = Note;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

InterruptScope::~InterruptScope() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool InterruptScope::Requested() const { return g_requested != 0; }

}  // namespace likeness
