//! `veduta eval`.

use std::path::Path;

use npyz::WriterBuilder as _;

use crate::common::{folder, veduta};

fn write_npy<T: npyz::AutoSerialize + Copy>(path: &Path, shape: &[u64], values: &[T]) {
    write_npy_order(path, shape, values, npyz::Order::C);
}

fn write_npy_order<T: npyz::AutoSerialize + Copy>(
    path: &Path,
    shape: &[u64],
    values: &[T],
    order: npyz::Order,
) {
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .order(order)
        .shape(shape)
        .writer(std::fs::File::create(path).unwrap())
        .begin_nd()
        .unwrap();
    writer.extend(values.iter().copied()).unwrap();
    writer.finish().unwrap();
}

fn read_npy<T: npyz::Deserialize>(path: &Path) -> (Vec<u64>, Vec<T>) {
    let file = npyz::NpyFile::new(std::fs::File::open(path).unwrap()).unwrap();
    (file.shape().to_vec(), file.into_vec().unwrap())
}

#[test]
fn a_module_function_agrees_with_its_twin() {
    let dir = folder("eval_phase");
    let rows: Vec<f64> = (0..200)
        .flat_map(|i| [f64::from(i) / 100.0 - 1.0, f64::from(i % 19) / 20.0 - 0.45])
        .collect();
    write_npy(&dir.join("rows.npy"), &[200, 2], &rows);
    veduta(
        &dir,
        &[
            "eval",
            "--import",
            "veduta::lighting::phase::phase_henyey_greenstein",
            "--expr",
            "phase_henyey_greenstein(in.f[0], in.f[1])",
            "--columns",
            "f,f",
            "--in",
            "rows.npy",
            "--out",
            "values.npy",
        ],
    )
    .good();
    let (shape, values) = read_npy::<f32>(&dir.join("values.npy"));
    assert_eq!(shape, [200]);
    for (row, value) in rows.chunks(2).zip(values) {
        // The device sees the row rounded to f32.
        let [mu, g] = [row[0], row[1]].map(|x| f64::from(x as f32));
        let twin = veduta::reference::phase::phase_henyey_greenstein(mu, g);
        assert!(
            (f64::from(value) - twin).abs() < 2e-6 * twin,
            "{row:?}: {value} {twin}"
        );
    }
}

#[test]
fn integers_and_vectors_go_through_npy() {
    let dir = folder("eval_integers");
    let rows: [i64; 6] = [1, 4_294_967_295, -2, 7, -2_147_483_648, 0];
    write_npy(&dir.join("rows.npy"), &[3, 2], &rows);
    let eval = |expression: &str, out: &str| {
        veduta(
            &dir,
            &[
                "eval",
                "--expr",
                expression,
                "--columns",
                "i,u",
                "--in",
                "rows.npy",
                "--out",
                out,
            ],
        )
        .good();
    };
    eval("vec3<i32>(in.i[0], in.i[0] + 1, -7)", "v.npy");
    let (shape, values) = read_npy::<i64>(&dir.join("v.npy"));
    assert_eq!(shape, [3, 3]);
    assert_eq!(
        values,
        [1, 2, -7, -2, -1, -7, -2_147_483_648, -2_147_483_647, -7]
    );
    eval("in.u[1]", "u.npy");
    assert_eq!(
        read_npy::<i64>(&dir.join("u.npy")),
        (vec![3], vec![4_294_967_295, 7, 0])
    );
    eval("in.i[0] < 0", "b.npy");
    assert_eq!(
        read_npy::<i64>(&dir.join("b.npy")),
        (vec![3], vec![0, 1, 1])
    );
    eval("vec2<f32>(f32(in.i[0]), 0.5)", "f.csv");
    assert_eq!(
        std::fs::read_to_string(dir.join("f.csv")).unwrap(),
        "1.0,0.5\n-2.0,0.5\n-2147483600.0,0.5\n"
    );
}

#[test]
fn expressions_without_a_column_have_values() {
    let dir = folder("eval_constants");
    std::fs::write(dir.join("rows.csv"), "1\n2\n").unwrap();
    for (expression, wanted) in [
        ("1.5", "1.5\n1.5\n"),
        ("7", "7\n7\n"),
        ("vec2(1u, 2u)", "1,2\n1,2\n"),
        ("vec4<bool>()", "0,0,0,0\n0,0,0,0\n"),
    ] {
        veduta(
            &dir,
            &[
                "eval",
                "--expr",
                expression,
                "--columns",
                "f",
                "--in",
                "rows.csv",
                "--out",
                "out.csv",
            ],
        )
        .good();
        assert_eq!(
            std::fs::read_to_string(dir.join("out.csv")).unwrap(),
            wanted,
            "{expression}"
        );
    }
}

#[test]
fn one_dimension_no_rows_and_every_type_are_read() {
    let dir = folder("eval_shapes");
    write_npy(&dir.join("one.npy"), &[3], &[0.5_f32, -1.0, f32::INFINITY]);
    write_npy(&dir.join("none.npy"), &[0, 1], &[0.0_f64; 0]);
    // Fortran order says nothing about one column.
    write_npy_order(
        &dir.join("column.npy"),
        &[2, 1],
        &[1.0_f64, 2.0],
        npyz::Order::Fortran,
    );
    for (name, wanted) in [
        ("one", vec![0.5, -1.0, f32::INFINITY]),
        ("none", vec![]),
        ("column", vec![1.0, 2.0]),
    ] {
        let input = format!("{name}.npy");
        veduta(
            &dir,
            &[
                "eval",
                "--expr",
                "in.f[0]",
                "--columns",
                "f",
                "--in",
                &input,
                "--out",
                "out.npy",
            ],
        )
        .good();
        let (shape, values) = read_npy::<f32>(&dir.join("out.npy"));
        assert_eq!((shape, values), (vec![wanted.len() as u64], wanted));
    }
}

#[test]
fn csv_round_trips_floats() {
    let dir = folder("eval_csv");
    let texts = [
        "0.1",
        "-0.0",
        "3.4028235e38",
        "1e-37",
        "16777217",
        "NaN",
        "-inf",
        "123456.79",
    ];
    let input = format!(
        "# a comment\nvalue, twice\n{}",
        texts.map(|t| format!("{t}, 2\n")).join("")
    );
    std::fs::write(dir.join("rows.csv"), input).unwrap();
    veduta(
        &dir,
        &[
            "eval",
            "--expr",
            "in.f[0]",
            "--columns",
            "f,i",
            "--in",
            "rows.csv",
            "--out",
            "out.csv",
        ],
    )
    .good();
    let out = std::fs::read_to_string(dir.join("out.csv")).unwrap();
    let values: Vec<f32> = out.lines().map(|l| l.parse().unwrap()).collect();
    assert_eq!(values.len(), texts.len());
    for (text, value) in texts.iter().zip(values) {
        let wanted: f32 = text.parse().unwrap();
        assert!(
            value.to_bits() == wanted.to_bits() || (value.is_nan() && wanted.is_nan()),
            "{text} became {value}"
        );
    }
}

#[test]
fn preludes_and_own_modules_are_taken() {
    let dir = folder("eval_prelude");
    std::fs::create_dir(dir.join("lib")).unwrap();
    std::fs::write(
        dir.join("lib/double.wgsl"),
        "//! Doubling.\n//! source   ours\n#define_import_path own::double\n\n/// Twice the argument.\n///\n/// domain  x in [-1e6, 1e6] 1 lin\n/// range   [-2e6, 2e6] 1\n/// source  ours\nfn double(x: f32) -> f32 {\n    return 2.0 * x;\n}\n",
    )
    .unwrap();
    std::fs::write(
        dir.join("prelude.wgsl"),
        "fn third(x: f32) -> f32 { return double(x) / 6.0; }\n",
    )
    .unwrap();
    std::fs::write(dir.join("rows.csv"), "3\n-6\n").unwrap();
    veduta(
        &dir,
        &[
            "eval",
            "--modules",
            "lib",
            "--prelude",
            "prelude.wgsl",
            "--import",
            "own::double::double",
            "--expr",
            "third(in.f[0])",
            "--columns",
            "f",
            "--in",
            "rows.csv",
            "--out",
            "out.csv",
        ],
    )
    .good();
    assert_eq!(
        std::fs::read_to_string(dir.join("out.csv")).unwrap(),
        "1.0\n-2.0\n"
    );
}

#[test]
fn faults_of_the_expression_are_told() {
    let dir = folder("eval_faults");
    std::fs::write(dir.join("rows.csv"), "3\n").unwrap();
    let eval = |extra: &[&str]| {
        let mut args = vec![
            "eval",
            "--columns",
            "f",
            "--in",
            "rows.csv",
            "--out",
            "out.csv",
        ];
        args.extend(extra);
        veduta(&dir, &args)
    };
    eval(&["--expr", "in.f[0] +"]).bad(1, &["expression:"]);
    eval(&["--expr", "mat2x2<f32>(in.f[0], 1.0, 2.0, 3.0)"]).bad(1, &["scalar or a vector"]);
    eval(&["--expr", "nois(in.f[0])"]).bad(1, &["nois"]);
    eval(&[
        "--expr",
        "1.0",
        "--import",
        "veduta::lighting::phase::phase_rayleig",
    ])
    .bad(1, &["phase_rayleig", "did you mean `phase_rayleigh`"]);
    eval(&["--expr", "1.0", "--prelude", "nowhere.wgsl"])
        .bad(1, &["nowhere.wgsl", "cannot be read"]);
    assert!(!dir.join("out.csv").exists());
}

#[test]
fn faults_of_the_rows_are_told() {
    let dir = folder("eval_rows");
    let eval = |columns: &str, input: &str| {
        veduta(
            &dir,
            &[
                "eval",
                "--expr",
                "1.0f",
                "--columns",
                columns,
                "--in",
                input,
                "--out",
                "out.npy",
            ],
        )
    };
    write_npy(&dir.join("f64.npy"), &[2, 2], &[1.0_f64, 2.0, 3.0, 0.5]);
    eval("f,i", "f64.npy").bad(
        1,
        &[
            "f64.npy: row 1, column 1",
            "is 0.5",
            "type i",
            "whole number",
        ],
    );
    eval("f", "f64.npy").bad(1, &["shape is (2, 2)", "(rows, 1)"]);
    eval("f,f,f", "f64.npy").bad(1, &["shape is (2, 2)", "(rows, 3)"]);
    eval("f,x", "f64.npy").bad(1, &["f,x", "1 to 64 of i, u, f"]);
    eval(&["f"; 65].join(","), "f64.npy").bad(1, &["1 to 64"]);
    write_npy(&dir.join("big.npy"), &[1], &[1e39_f64]);
    eval("f", "big.npy").bad(1, &["row 0, column 0", "1e39", "f32"]);
    write_npy(&dir.join("i64.npy"), &[2], &[0_i64, -1]);
    eval("u", "i64.npy").bad(1, &["row 1, column 0", "-1", "[0, 4294967295]"]);
    write_npy(&dir.join("i32.npy"), &[2], &[0_i32, -1]);
    eval("i", "i32.npy").bad(1, &["<i4", "float32, float64 or int64"]);
    write_npy(&dir.join("cube.npy"), &[1, 1, 1], &[0.0_f32]);
    eval("f", "cube.npy").bad(1, &["shape is (1, 1, 1)"]);
    write_npy_order(
        &dir.join("fortran.npy"),
        &[2, 2],
        &[0.0_f32; 4],
        npyz::Order::Fortran,
    );
    eval("f,f", "fortran.npy").bad(1, &["Fortran order"]);
    let bytes = std::fs::read(dir.join("f64.npy")).unwrap();
    std::fs::write(dir.join("short.npy"), &bytes[..bytes.len() - 1]).unwrap();
    eval("f,f", "short.npy").bad(1, &["is truncated", "needs 32 bytes", "there are 31"]);
    std::fs::write(dir.join("long.npy"), [&bytes[..], &[0]].concat()).unwrap();
    eval("f,f", "long.npy").bad(1, &["bytes behind its end"]);
    std::fs::write(dir.join("header.npy"), &bytes[..20]).unwrap();
    eval("f,f", "header.npy").bad(1, &["truncated inside its header"]);
    std::fs::write(dir.join("text.npy"), "1,2\n").unwrap();
    eval("f,f", "text.npy").bad(1, &["no NPY file"]);
    std::fs::write(dir.join("ragged.csv"), "1,2\n3\n").unwrap();
    eval("f,f", "ragged.csv").bad(1, &["line 2 has 1 column", "names 2"]);
    std::fs::write(dir.join("word.csv"), "1,2\n3,four\n").unwrap();
    eval("f,f", "word.csv").bad(1, &["row 1, column 1", "`four`"]);
    std::fs::write(dir.join("half.csv"), "x,2\n3,4\n").unwrap();
    eval("f,f", "half.csv").bad(1, &["row 0, column 0", "`x`"]);
    std::fs::write(dir.join("rows.txt"), "1\n").unwrap();
    eval("f", "rows.txt").bad(1, &["rows.txt", "`.npy` or `.csv`"]);
    eval("f", "nowhere.npy").bad(1, &["nowhere.npy", "cannot be read"]);
    std::fs::write(dir.join("good.csv"), "1\n").unwrap();
    veduta(
        &dir,
        &[
            "eval",
            "--expr",
            "1.0f",
            "--columns",
            "f",
            "--in",
            "good.csv",
            "--out",
            "no/out.npy",
        ],
    )
    .bad(1, &["no/out.npy", "its folder does not exist"]);
}
