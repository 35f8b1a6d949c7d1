// The figures, a function for each kind. Internal to analysis/report/figures.
#pragma once

#include "analysis/report/figures/sheet.h"
#include "analysis/report/sections.h"

#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace tunnelrig::report {

/// One figure: commands that draw it on the sheet, after terminal and output are set.
struct Figure {
  std::string name;  // of its file, without the end
  Sheet sheet;
  std::string script;
  std::string caption;  // what is seen, with units, and what bars and bands are
};

/// What came of a kind of figure.
struct Figures {
  std::vector<Figure> drawn;
  std::vector<AbsentFigure> absent;
};

/// delta_ct, uneven_thrust, and the U95 of each.
Figures map_figures(const Material& material, double width_mm);

/// c_t_by_location and uneven_by_location: the thesis's figure 4.17, with U95.
Figures location_figures(const Material& material, double width_mm);

/// open_space: the middle and the outermost column against OS, GND and CEIL.
Figures open_space_figures(const Material& material, double width_mm);

/// calibration_residuals: every point of every cell.
Figures calibration_figures(const Material& material, double width_mm);

/// residual_before_after: of the version of the model that is in force.
Figures residual_figures(const Material& material, double width_mm);

/// flight_1_paths, flight_1_errors, …: of every scenario in flights.json. `flights` is a section.
Figures flight_figures(const Json& flights, double width_mm);

/// Those of category_colours.h, again from the first after the last.
std::string category_colour(std::size_t i);

/// The i-th of n colours of an ordered set: plasma (van der Walt and Smith 2015) without its pale end.
std::string ordered_colour(std::size_t i, std::size_t n);

/// "$name << END … END": rows of numbers, a NaN where one is not known.
std::string data_block(const std::string& name, const std::vector<std::vector<double>>& rows);

/// gnuplot's point types that all three terminals fill alike: circle, square, triangles, diamond.
int point_type(std::size_t i);

}  // namespace tunnelrig::report
