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

/// Faults stand where the caller wrote them, not where the composed text has them.
#[test]
fn faults_have_the_callers_places() {
    let fault = |imports: &[&str], prelude: &str, expression: &str| {
        let spec = Spec {
            imports,
            prelude,
            prelude_file: "pre.wgsl",
            expression,
            columns: 1,
            features: &[],
        };
        match Evaluator::new(gpu(), &modules(), &spec) {
            Ok(_) => "no fault".to_owned(),
            Err(error) => error.to_string(),
        }
    };
    let begins = |found: &str, wanted: &str| {
        assert!(found.starts_with(wanted), "{found}\ninstead of\n{wanted}");
    };
    let shows = |found: &str, place: &str, line: &str, column: usize| {
        begins(found, place);
        let shown = format!("\n{line}\n{}^", " ".repeat(column - 1));
        assert!(found.contains(&shown), "{found}\nwithout\n{shown}");
    };
    let phase = "veduta::lighting::phase::phase_rayleigh";
    let schlick = "veduta::lighting::phase::phase_schlick";
    let both = "phase_rayleigh(1.0) + phase_schlick(1.0, 0.5)";
    for (imports, expression) in [
        (&[][..], "1.0"),
        (&[phase], "phase_rayleigh(1.0)"),
        (&[phase, schlick], both),
    ] {
        let line = "fn g(x: f32) -> f32 { return x + nought; }";
        let prelude = format!("fn f(x: f32) -> f32 {{ return x; }}\n\n{line}\n");
        for prelude in [prelude.clone(), prelude.replace('\n', "\r\n")] {
            let found = fault(imports, &prelude, expression);
            shows(&found, "pre.wgsl:3:34: ", line, 34);
        }
    }
    // An open brace is missed at the end of the text that has opened it.
    begins(
        &fault(&[], "fn g() -> f32 { return 1.0;", "1.0"),
        "pre.wgsl:1:28: ",
    );
    // The expression, behind a prelude or not, in one line or two.
    for prelude in ["", "const ONE: f32 = 1.0;\n// The end."] {
        let expression = "in.f[0] + nought";
        shows(
            &fault(&[], prelude, expression),
            "expression:1:11: ",
            expression,
            11,
        );
        shows(
            &fault(&[phase], prelude, "phase_rayleigh(nought)"),
            "expression:1:16: ",
            "phase_rayleigh(nought)",
            16,
        );
        shows(
            &fault(&[], prelude, "in.f[0]\n  * nought"),
            "expression:2:5: ",
            "  * nought",
            5,
        );
        shows(
            &fault(&[], prelude, "in.f[0] +"),
            "expression:1:10: ",
            "in.f[0] +",
            10,
        );
        begins(&fault(&[], prelude, ""), "expression:1:1: ");
    }
    begins(&fault(&[], "", "in.f[0] // with a remark"), "no fault");
    // An import.
    let missing = "veduta::lighting::phase::phase_rayleig";
    let found = fault(&[missing], "", "1.0");
    shows(&found, "import:1:26: ", missing, 26);
    let found = fault(&[phase, missing], "", "phase_rayleigh(1.0)");
    shows(&found, "import:2:26: ", missing, 26);
    // Without a name the prelude is called that.
    let unnamed = Spec {
        prelude: "fn g() -> f32 { return nought; }",
        expression: "1.0",
        columns: 1,
        ..Default::default()
    };
    let error = Evaluator::new(gpu(), &modules(), &unnamed).unwrap_err();
    begins(&error.to_string(), "prelude:1:24: ");
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
    assert!(new("in.f[0]", 65).contains("1 to 64"));
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
