// As numeric.h, for tests.
#pragma once

#include "numeric.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
