//! Elementary functions that keep their relative accuracy where the direct formula cancels.
//! source   elementary; thresholds and degrees: ours
//! symbols  x dimensionless argument, for instance an optical depth [1]
#define_import_path veduta::math::series

/// Taylor series of (1 - exp(-x)) / x, for x < 0.5.
///
/// internal
fn one_minus_exp_over_x_series(x: f32) -> f32 {
    return 1.0 + x * (-0.5 + x * (0.16666667 + x * (-0.041666668 + x * (0.008333334
        + x * (-0.0013888889 + x * (0.0001984127 - x * 2.4801588e-5))))));
}

/// Share of a step's light that survives on average: (1 - exp(-x)) / x, with the limit 1 at x = 0.
///
/// domain  x in [1e-20, 1e6] 1 log
/// range   [0, 1] 1
/// error   5e-7 rel of reference::math::one_minus_exp_over_x
/// monotone x
/// outside undefined
/// source  Taylor series below 0.5, the direct form above
fn one_minus_exp_over_x(x: f32) -> f32 {
    let large = max(x, 0.5);
    return select((1.0 - exp(-large)) / large, one_minus_exp_over_x_series(x), x < 0.5);
}

/// Absorbed share of light after the optical depth x: 1 - exp(-x), without the cancellation at small x.
///
/// domain  x in [1e-20, 1e6] 1 log
/// range   [0, 1] 1
/// error   5e-7 rel of reference::math::one_minus_exp
/// monotone x
/// outside undefined
/// source  Taylor series below 0.5, the direct form above
fn one_minus_exp(x: f32) -> f32 {
    return select(1.0 - exp(-x), x * one_minus_exp_over_x_series(x), x < 0.5);
}
