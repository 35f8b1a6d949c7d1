// The distributions that intervals and tests are made of. Degrees of freedom need not be whole numbers
// (Welch–Satterthwaite gives fractions) and may be infinite.
#pragma once

namespace tunnelrig {

/// x with P(N ≤ x) = p, 0 < p < 1.
double normal_quantile(double p);

/// P(|T| > |t|) of Student's t.
double student_t_two_sided_p(double t, double dof);

/// t with P(T ≤ t) = p, 0 < p < 1; relative error below 1e-8.
double student_t_quantile(double p, double dof);

/// Half width of the 95 % interval of an estimate with this standard error: t(0.975, dof) times it.
double half_width_95(double standard_error, double dof);

/// P(F > f) of Fisher's F, f ≥ 0; dof2 above 1e6 counts as infinite (relative error of order dof1 f / dof2).
double f_upper_p(double f, double dof1, double dof2);

/// P(X > x) of chi-square, x ≥ 0.
double chi2_upper_p(double x, double dof);

/// x with P(X ≤ x) = p, 0 < p < 1; relative error below 1e-8 up to a million degrees of freedom.
double chi2_quantile(double p, double dof);

}  // namespace tunnelrig
