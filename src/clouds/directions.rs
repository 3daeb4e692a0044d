//! Directions of equal weight that integrate harmonics up to the seventh degree exactly.

/// The 24 points of McLaren's design: the corners of an improved snub cube.
pub(super) fn directions() -> Vec<[f64; 3]> {
    const CORNER: [f64; 3] = [
        0.866_246_818_107_820_6,
        0.422_518_653_761_111_5,
        0.266_635_401_516_704_7,
    ];
    let [a, b, c] = CORNER;
    let even = [[a, b, c], [b, c, a], [c, a, b]];
    let odd = [[b, a, c], [a, c, b], [c, b, a]];
    let mut points = Vec::with_capacity(24);
    for (list, parity) in [(even, 0), (odd, 1)] {
        for point in list {
            for signs in 0..8_u32 {
                if (3 - signs.count_ones()) % 2 == parity {
                    points.push(std::array::from_fn(|k| {
                        if signs >> k & 1 == 1 {
                            -point[k]
                        } else {
                            point[k]
                        }
                    }));
                }
            }
        }
    }
    points
}

/// Real spherical harmonics up to the third degree, as the module `veduta::clouds::harmonics` has them.
pub(super) fn harmonics([x, y, z]: [f64; 3]) -> [f64; 16] {
    let root = |v: f64| (v / std::f64::consts::PI).sqrt();
    let (first, third) = (root(0.75), 0.25 * root(10.5));
    [
        0.5 * root(1.0),
        first * y,
        first * z,
        first * x,
        0.5 * root(15.0) * x * y,
        0.5 * root(15.0) * y * z,
        0.25 * root(5.0) * (3.0 * z * z - 1.0),
        0.5 * root(15.0) * x * z,
        0.25 * root(15.0) * (x * x - y * y),
        0.25 * root(17.5) * y * (3.0 * x * x - y * y),
        0.5 * root(105.0) * x * y * z,
        third * y * (5.0 * z * z - 1.0),
        0.25 * root(7.0) * z * (5.0 * z * z - 3.0),
        third * x * (5.0 * z * z - 1.0),
        0.25 * root(105.0) * z * (x * x - y * y),
        0.25 * root(17.5) * x * (x * x - 3.0 * y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_integrate_products_of_harmonics() {
        let all = directions();
        assert_eq!(all.len(), 24);
        let share = 4.0 * std::f64::consts::PI / 24.0;
        for i in 0..16 {
            for j in 0..16 {
                let sum: f64 = all
                    .iter()
                    .map(|d| harmonics(*d)[i] * harmonics(*d)[j])
                    .sum();
                let wanted = f64::from(u8::from(i == j));
                assert!(
                    (share * sum - wanted).abs() < 1e-9,
                    "{i} {j} {}",
                    share * sum
                );
            }
        }
    }
}
