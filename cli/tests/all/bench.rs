//! `veduta bench`, small.

use veduta_cli::bench::knob::{self, Effect, Knob};
use veduta_cli::bench::timing::{Clock, Rounds, beside_bases};
use veduta_cli::bench::{Bench, baseline, chapter6, presets};
use veduta_cli::catalog::{Catalog, SourceArgs};
use veduta_cli::commands::render::RenderArgs;
use veduta_cli::render::Size;

use crate::common::{folder, json, png, veduta};

fn bench(clock: Clock, cache: Option<std::path::PathBuf>) -> Bench {
    Bench {
        gpu: veduta::device::shared().unwrap().clone(),
        clock,
        size: Size {
            width: 48,
            height: 27,
        },
        cache,
        base: RenderArgs::default(),
    }
}

const FEW: Rounds = Rounds { least: 3, most: 3 };

#[test]
fn more_cloud_steps_take_longer_and_come_nearer() {
    let dir = folder("bench_knob");
    let run = veduta(
        &dir,
        &[
            "bench",
            "--effect",
            "clouds",
            "--knob",
            "CLOUD_STEPS=8..32",
            "--size",
            "48x27",
            "--rounds",
            "3",
            "--most-rounds",
            "3",
            "--out",
            "result",
        ],
    )
    .good();
    assert!(
        run.out.contains("| CLOUD_STEPS |") && run.out.contains("front"),
        "{}",
        run.out
    );
    let report = json(&dir.join("result/cloud_steps.json"));
    let entries = report["entries"].as_array().unwrap();
    assert_eq!(entries.len(), 3);
    for pair in entries.windows(2) {
        let of = |k: usize, name: &str| pair[k][name].as_f64().unwrap();
        assert!(of(1, "psnr_db") > of(0, "psnr_db") + 3.0, "{pair:?}");
        assert!(of(1, "relative_rmse") < of(0, "relative_rmse"));
        // Twice the steps are exactly twice the samples.
        assert!((of(1, "density") / of(0, "density") - 2.0).abs() < 1e-9);
    }
    let (width, height, _) = png(&dir.join("result/cloud_steps.png"));
    assert_eq!((width, height), (4 * 48 + 3 * 4, 27));
    let plot = std::fs::read_to_string(dir.join("result/cloud_steps.svg")).unwrap();
    for part in [
        "PSNR against the converged picture [dB]",
        "Pareto front",
        "logarithmic",
    ] {
        assert!(plot.contains(part), "{part}");
    }
}

#[test]
fn knobs_are_read() {
    let catalog = Catalog::load(&SourceArgs::default()).unwrap();
    let values = |text: &str| -> Vec<String> {
        let knob = Knob::parse(catalog.set(), text).unwrap();
        knob.values.iter().map(|v| v.to_string()).collect()
    };
    assert_eq!(values("CLOUD_STEPS=8..70"), ["8", "16", "32", "64"]);
    assert_eq!(values("CLOUD_STEPS=5,7"), ["5", "7"]);
    assert_eq!(values("STEP_FACTOR=0.125..0.5"), ["0.125", "0.25", "0.5"]);
    assert_eq!(values("TEXTURE_FILTERING"), ["false", "true"]);
    for text in [
        "CLOUD_STEP=1",
        "CLOUD_STEPS=0..8",
        "CLOUD_STEPS=9..8",
        "CLOUD_STEPS=",
        "CLOUD_STEPS=1.5",
        "CLOUD_STEPS=1..x",
        "",
    ] {
        assert!(Knob::parse(catalog.set(), text).is_err(), "{text}");
    }
}

#[test]
fn every_effect_has_a_converged_picture() {
    let bench = bench(Clock::Wall, None);
    let catalog = Catalog::load(&SourceArgs::default()).unwrap();
    for (effect, knob) in [
        (Effect::Atmosphere, "ATMOS_STEPS=8,16"),
        (Effect::Terrain, "OCTAVES=6,10"),
        (Effect::Textures, "TEXTURE_LOW_QUALITY"),
    ] {
        let knob = Knob::parse(catalog.set(), knob).unwrap();
        let report = knob::run(&bench, effect, &knob, "thesis", "V01", FEW, &mut |_| {}).unwrap();
        assert_eq!((report.entries.len(), report.pictures.len()), (2, 3));
        for entry in &report.entries {
            println!("{effect:?} {}: {:?}", entry.value, entry.difference);
            assert!(entry.difference.psnr > 12.0 && entry.difference.psnr.is_finite());
            assert!(entry.time.median > 0.0);
            // The terrain's own knobs move where rays hit; the air has an f64 reference.
            assert_eq!(entry.depth.is_some(), effect == Effect::Terrain);
            assert_eq!(entry.to_truth.is_some(), effect == Effect::Atmosphere);
        }
        if let [Some(few), Some(many)] = [0, 1].map(|k| report.entries[k].depth) {
            // Ten octaves are those of the converged terrain, six another ground.
            println!("6 octaves {few:?}, 10 {many:?}");
            assert!(many.both > 200 && many.median < 1e-3 && many.percentile_99 < 0.05);
            assert!(few.flips > many.flips && few.median > 4.0 * many.median);
        }
        if let [Some(few), Some(many)] = [0, 1].map(|k| report.entries[k].to_truth) {
            println!("8 and 16 steps are {few:.5} and {many:.5} from the f64 reference");
            assert!(many < 0.05 && many < 0.5 * few);
        }
        assert!(report.entries.iter().any(|e| e.on_front));
    }
}

#[test]
fn presets_are_compared_with_the_baseline_and_references_are_kept() {
    let dir = folder("bench_presets");
    let bench = bench(Clock::Wall, Some(dir.join("cache")));
    let plan = presets::Plan {
        scene: "thesis".to_owned(),
        presets: vec!["thesis_low".to_owned()],
        views: vec!["V08".to_owned()],
        // Not converged; the test is of the bench.
        reference: "thesis".to_owned(),
        samples: 1,
        rounds: FEW,
    };
    let entries = presets::run(&bench, &plan, &mut |_| {}).unwrap();
    let names: Vec<&str> = entries.iter().map(|e| e.preset.as_str()).collect();
    assert_eq!(names, ["thesis", "thesis_skip", "thesis_low"]);
    assert_eq!(entries[0].to_thesis.median, 1.0);
    assert_eq!(
        entries[0].difference.psnr,
        f64::INFINITY,
        "the reference is the preset itself"
    );
    assert!(
        entries[1].difference.psnr > 35.0,
        "{:?}",
        entries[1].difference
    );
    assert!(entries[2].to_thesis.median < 0.9 && entries[2].difference.psnr < 30.0);
    // The second run takes the reference from the folder: a file that is changed shows.
    let files: Vec<_> = std::fs::read_dir(dir.join("cache"))
        .unwrap()
        .map(|f| f.unwrap().path())
        .collect();
    assert_eq!(files.len(), 1);
    let size = std::fs::metadata(&files[0]).unwrap().len();
    assert_eq!(size, 48 * 27 * 12);
    std::fs::write(&files[0], vec![0; size as usize]).unwrap();
    let again = presets::run(&bench, &plan, &mut |_| {}).unwrap();
    assert!(again[0].difference.psnr < 20.0);
    let text = presets::markdown(&bench, &plan, &entries, "test");
    for part in ["llvm", "## `thesis_low`", "| V08 ", "time / thesis_skip"] {
        assert!(text.to_lowercase().contains(&part.to_lowercase()), "{part}");
    }
    let mut earlier = presets::to_json(&bench, &entries, "test");
    assert_eq!(earlier["command"], "test");
    assert_eq!(earlier["entries"].as_array().unwrap().len(), 3);
    // Against itself nothing differs; a ratio that was another, and surely so, does.
    let same = presets::compare(&entries, &earlier);
    assert_eq!((same.apart, same.largest), (0, 0.0));
    let mut sure = entries.clone();
    sure[2].to_thesis.uncertainty = 0.0;
    earlier["entries"][2]["to_thesis"] =
        serde_json::json!({ "median": 1.25 * sure[2].to_thesis.median, "conclusive": true });
    let other = presets::compare(&sure, &earlier);
    assert!(
        other.apart == 1 && (other.largest - 0.2).abs() < 1e-9,
        "{other:?}"
    );
    assert!(presets::repeatability(&sure, &earlier).contains("1 differ"));
}

#[test]
fn row_l41_l42_l43_chapter_6_is_repeated() {
    let dir = folder("bench_chapter6");
    let bench = bench(Clock::Wall, None);
    let plan = chapter6::Plan {
        seconds: 4,
        rounds: FEW,
        quick: true,
    };
    let report = chapter6::run(&bench, &plan, &dir, &mut |_| {}).unwrap();
    chapter6::write(&bench, &report, "test", &dir).unwrap();
    // L41: low quality is faster. A frame by itself may be held up by other work on the machine.
    assert_eq!(report.flight.len(), 4);
    let middle = |times: Vec<f64>| veduta_cli::render::median(times).unwrap();
    let normal = middle(report.flight.iter().map(|s| s.normal).collect());
    let low = middle(report.flight.iter().map(|s| s.low).collect());
    assert!(normal > low, "{normal} against {low}");
    // L42: more steps, more time, less error.
    let at = |p, s| {
        report
            .sweep
            .iter()
            .find(|e| e.primary == p && e.secondary == s)
            .unwrap()
    };
    assert_eq!(report.sweep.len(), 6);
    let psnr = |p, s| at(p, s).difference.psnr;
    for primary in [16, 32, 64] {
        let (twelve, six) = (psnr(primary, 12), psnr(primary, 6));
        assert!(twelve > six + 0.3, "{primary}: {twelve} against {six}");
    }
    for secondary in [6, 12] {
        for primary in [32, 64] {
            let (more, least) = (psnr(primary, secondary), psnr(16, secondary));
            assert!(more > least + 2.0, "{primary}: {more} against {least}");
        }
    }
    // Eight times the samples of the clouds, and more than twice the time of the whole picture; the quicker draws, which
    // other work on the machine has held up least.
    assert!(at(64, 12).time.quartiles.0 > at(16, 6).time.quartiles.0);
    // L43: jitter turns stripes into noise.
    let jitter = report.jitter[0];
    assert!(jitter.stripes_on < 0.6 * jitter.stripes_off, "{jitter:?}");
    assert!(dir.join("chapter6.json").is_file());
    let text = std::fs::read_to_string(dir.join("chapter6.md")).unwrap();
    let embedded: Vec<&str> = text
        .split("](")
        .skip(1)
        .filter_map(|t| Some(t.split_once(')')?.0))
        .filter(|t| !t.ends_with(".md"))
        .collect();
    for file in [
        "flight.svg",
        "flight_quality.png",
        "cloud_steps.svg",
        "cloud_steps.png",
        "cloud_steps_error_x8.png",
        "jitter.png",
        "jitter_16_error_x8.png",
    ] {
        assert!(embedded.contains(&file), "{file}: {embedded:?}");
    }
    for file in embedded {
        assert!(dir.join(file).is_file(), "{file}");
    }
}

#[test]
fn device_timestamps_agree_with_the_clock_on_the_wall() {
    let bench = bench(Clock::Wall, None);
    if !bench
        .gpu
        .device
        .features()
        .contains(veduta::wgpu::Features::TIMESTAMP_QUERY)
    {
        println!("this device has no timestamps");
        return;
    }
    let job = bench.job("clear", "thesis", "V01", &[]).unwrap();
    let mut subject = bench.subject(&job, 0.0).unwrap();
    subject.renderer.warm_up(&subject.view).unwrap();
    let mut shares = Vec::new();
    for _ in 0..5 {
        let device = subject.draw(Clock::Gpu).unwrap();
        let wall = subject.draw(Clock::Wall).unwrap();
        assert!(device > 0.0 && wall > 0.0);
        shares.push(device / wall);
    }
    let share = veduta_cli::render::median(shares).unwrap();
    println!("timestamps over wall time: {share:.2}");
    assert!((0.2..2.0).contains(&share), "{share}");
}

#[test]
fn a_subject_against_itself_has_the_ratio_1() {
    let bench = bench(Clock::Cpu, None);
    let job = bench.job("sky", "thesis_skip", "V01", &[]).unwrap();
    let mut subjects = vec![
        bench.subject(&job, 0.0).unwrap(),
        bench.subject(&job, 0.0).unwrap(),
    ];
    let rounds = Rounds { least: 9, most: 9 };
    let turns = beside_bases(&mut subjects, &[0], Clock::Cpu, rounds, &mut || {}).unwrap();
    assert!(turns.times.iter().all(|t| t.len() == 9));
    let ratio = turns.ratio(1, 0);
    assert_eq!(turns.ratio(0, 0).median, 1.0);
    assert!(turns.ratio(0, 1).median.is_nan(), "the second is no base");
    println!("against itself: {ratio} +- {:.3}", ratio.uncertainty);
    assert!((0.4..2.5).contains(&ratio.median), "{ratio:?}");
}

#[test]
fn the_baseline_is_measured_beside_the_machine() {
    let dir = folder("bench_baseline");
    veduta(
        &dir,
        &[
            "bench",
            "baseline",
            "--size",
            "48x27",
            "--rounds",
            "2",
            "--out",
            "baseline.md",
        ],
    )
    .good();
    let text = std::fs::read_to_string(dir.join("baseline.md")).unwrap();
    for part in [
        "PCG, one chain",
        "`thesis_skip`",
        "at the aim's speed",
        "--size 48x27",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    veduta(
        &dir,
        &["bench", "noise", "--rounds", "1", "--out", "noise.md"],
    )
    .good();
    let noises = json(&dir.join("noise.json"));
    let noises = noises["noises"].as_array().unwrap();
    assert!(noises.len() >= 8);
    assert!(
        noises
            .iter()
            .all(|n| n["measured"].as_f64().unwrap() > 0.01),
        "{noises:?}"
    );
    veduta(&dir, &["bench", "noise", "--against", "noise.json"]).bad(1, &["--against", "presets"]);
    // At half the speed a frame counts half.
    let round = baseline::Round {
        speed: baseline::Speed {
            chain: 0.5 * baseline::AIM_SPEED.chain,
            side_by_side: baseline::AIM_SPEED.side_by_side,
        },
        thesis: 600.0,
        skip: 300.0,
        clear: 200.0,
    };
    assert_eq!(round.at_the_speed_of_the_aim(), (300.0, 600.0));
}

#[test]
fn wrong_arguments_are_named() {
    let dir = folder("bench_wrong");
    veduta(&dir, &["bench", "knob"]).bad(1, &["--knob", "CLOUD_STEPS=8..256"]);
    veduta(&dir, &["bench", "--knob", "CLOUD_STEP=8..16"]).bad(1, &["CLOUD_STEP", "CLOUD_STEPS"]);
    veduta(&dir, &["bench", "--knob", "CLOUD_STEPS=8..9999999"]).bad(1, &["CLOUD_STEPS"]);
    veduta(&dir, &["bench", "presets", "--knob", "CLOUD_STEPS=8..16"]).bad(1, &["--knob"]);
    veduta(&dir, &["bench", "--rounds", "0"]).bad(2, &["--rounds"]);
    // Told before the work.
    veduta(&dir, &["bench", "--effect", "clouds"]).bad(2, &["--knob"]);
    veduta(&dir, &["bench", "--rounds", "20", "--most-rounds", "3"]).bad(1, &["--rounds", "20"]);
    veduta(&dir, &["bench", "chapter6", "--views", "V02"]).bad(1, &["--views", "V02"]);
    veduta(&dir, &["bench", "presets", "--seconds", "3"]).bad(1, &["--seconds"]);
    veduta(&dir, &["bench", "presets", "--of", "nope"]).bad(1, &["nope"]);
    veduta(&dir, &["bench", "presets", "--out", "no/such/file.md"]).bad(1, &["no/such"]);
    veduta(&dir, &["bench", "--knob", "CLOUD_STEPS=8,8"]).bad(1, &["8,8", "once"]);
    veduta(&dir, &["bench", "--knob", "CLOUD_COVERAGE=0.1,0.3"])
        .bad(1, &["CLOUD_COVERAGE", "quality"]);
    veduta(&dir, &["bench", "--knob", "CLOUDS"]).bad(1, &["CLOUDS", "quality"]);
    // A driver that ends loops in silence would cut this picture short.
    let run = veduta(
        &dir,
        &[
            "bench",
            "--effect",
            "clouds",
            "--knob",
            "CLOUD_STEPS=4096",
            "--set",
            "CLOUD_LIGHT_STEPS=64",
            "--size",
            "16x9",
        ],
    );
    let device = veduta::device::shared().unwrap().adapter.get_info().name;
    if device.contains("llvmpipe") {
        run.bad(1, &["CLOUD_STEPS=4096", "65535"]);
    } else {
        run.good();
    }
    veduta(&dir, &["bench", "--views", "V99", "--size", "8x8"]).bad(1, &["V99"]);
}
