// As numeric.h, for the command line's verbs.
#pragma once

#include "numeric.h"

#include <CLI/CLI.hpp>
