// As common.h, for folders that compute with matrices.
#pragma once

#include "common.h"

#include <Eigen/Dense>
