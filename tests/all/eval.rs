//! The evaluator itself: types, columns, special values and faults.

use crate::common::{Random, evaluator, gpu, modules};
use veduta::eval::{Column, Evaluator, ResultKind, Spec};

#[test]
fn columns_and_types_arrive_bit_by_bit() {
    let f = evaluator(&[], "", "vec3f(in.f[1], f32(in.i[0]), -in.f[1])", 2);
    assert_eq!((f.width(), f.kind()), (3, ResultKind::F32));
    let rows = [(-3_i32) as u32, 0x7fc0_1234, 7, 1.5_f32.to_bits()];
    let bits = f.run_bits(&rows).unwrap();
    assert_eq!(bits[0], 0x7fc0_1234, "a NaN keeps its payload");
    assert_eq!(f.run(&rows).unwrap()[3..], [1.5, 7.0, -1.5]);
    let b = evaluator(&[], "", "in.u[0] > 3u", 1);
    assert_eq!((b.width(), b.kind()), (1, ResultKind::Bool));
    assert_eq!(b.run_bits(&[3, 4]).unwrap(), [0, 1]);
}

#[test]
fn many_rows_are_cut_into_chunks_without_loss() {
    let f = evaluator(&[], "", "in.u[0] * 3u + in.u[1]", 2);
    let mut random = Random(1);
    let rows: Vec<u32> = (0..2 * ((1 << 20) + 77))
        .map(|_| random.bits() as u32)
        .collect();
    let values = f.run_bits(&rows).unwrap();
    assert_eq!(values.len(), rows.len() / 2);
    for (row, value) in rows.chunks(2).zip(values) {
        assert_eq!(row[0].wrapping_mul(3).wrapping_add(row[1]), value);
    }
}

#[test]
fn faults_are_typed() {
    let new = |expression, columns| {
        Evaluator::new(
            gpu(),
            &modules(),
            &Spec {
                expression,
                columns,
                ..Default::default()
            },
        )
        .unwrap_err()
        .to_string()
    };
    assert!(new("in.f[0]", 17).contains("1 to 16"));
    assert!(
        new("in.f[0] +", 1).contains("expression"),
        "{}",
        new("in.f[0] +", 1)
    );
    assert!(new("mat2x2f(in.f[0], 0.0, 0.0, 1.0)", 1).contains("scalar or a vector"));
    assert!(Column::parse_list("i,x").is_err() && Column::parse_list("").is_err());
    let f = evaluator(&[], "", "in.f[0]", 2);
    assert!(
        f.run_bits(&[1, 2, 3])
            .unwrap_err()
            .to_string()
            .contains("whole rows of 2")
    );
}
