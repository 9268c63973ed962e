//! A job builds everything in a scene once: constructors count their calls. This is the only test of its process, since the counters are global.

use std::{collections::BTreeMap, fs, path::Path};

use bansho::{
    Unobserved,
    base::host::constructions,
    job::{self, Job, SceneFile},
};

/// One of each phenomenon, and a solid of each kind.
const SCENE: &str = "\
bansho = 2
[picture]
size = [32, 18]
frames = 6
[[flame_sheet]]
[[flame_particles]]
particles = 60
preroll_s = 0.1
[[rain]]
[[aurora]]
preroll_s = 0.0
particles = { count = 200 }
[[obstacle]]
position = [0, 0, -4]
[[obstacle]]
shape = \"mesh\"
file = \"ring.glb\"
position = [0, 0, -8]
";

fn once() -> BTreeMap<&'static str, u64> {
    [("aurora", 1), ("distance_field", 1), ("flame_particles", 1), ("flame_sheet", 1), ("obstacle", 2), ("rain", 1)]
        .into()
}

#[test]
fn a_job_builds_everything_once() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/meshes/ring.glb");
    fs::copy(mesh, folder.path().join("ring.glb")).unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, SCENE).unwrap();
    let scene = || SceneFile::read(&path).unwrap();
    constructions::take();

    let (compiled, plan) = job::check_scene(&scene()).unwrap();
    job::remarks(&scene(), &compiled, &plan);
    assert_eq!(constructions::take(), once(), "a check, and its remarks");

    let out = |name: &str| Some(folder.path().join(name).join("f.####.png"));
    let job = Job { out: out("plain"), ..Job::new(scene()) };
    job.prepare().unwrap().run(&Unobserved).unwrap();
    assert_eq!(constructions::take(), once(), "frames");

    // Frame 1 after frame 4 is a restart.
    let job = Job { out: out("loop"), loop_s: Some(0.2), ..Job::new(scene()) };
    job.prepare().unwrap().run(&Unobserved).unwrap();
    assert_eq!(constructions::take(), once(), "a loop, whose crossfade takes two runs");

    let snapshots = Some(folder.path().join("states"));
    let job = Job { out: out("kept"), snapshots: snapshots.clone(), snapshot_every: Some(2), ..Job::new(scene()) };
    job.prepare().unwrap().run(&Unobserved).unwrap();
    let job = Job { out: out("restored"), snapshots, frames: Some(vec![5]), ..Job::new(scene()) };
    constructions::take();
    job.prepare().unwrap().run(&Unobserved).unwrap();
    assert_eq!(constructions::take(), once(), "a restored snapshot");
}
