// What keys do: one table for the keyboard and for the help.

#pragma once

#include <span>

#include "likeness/viewer/view_state.h"

namespace likeness {

struct KeyBinding {
  int key;           // as WindowInput::keys has it
  const char* name;  // as the help shows it
  const char* what;
  void (*act)(ViewState* state);
};

std::span<const KeyBinding> KeyBindings();

// Does what the key is for; nothing for others.
void PressKey(int key, ViewState* state);

}  // namespace likeness
