//! Every rule of a scene refuses with a message that names file, field, value and remedy.

use scene::Scene;

const SCENE: &str = r#"
format = 1
name = "rig"

[[model]]
name = "arm"
role = "robot"
urdf = "arm.urdf"

[[model]]
name = "cube"
role = "object"
urdf = "cube.urdf"

[[obstacle]]
name = "wall"
box = { size = [1.0, 2.0, 3.0] }
xyz = [9.0, 0.0, 0.0]

[coordinates]
order = ["turn", "slide", "cube"]
limits = { turn = [-2.0, 2.0] }

[collision]
exclude = [["arm/tip", "wall"]]

[task.move]
start = [0.0, 0.0, -0.5]
goal = [0.0, 0.0, 0.5]
max_grasps = 4
clearance = 0.0
grasp = { bounds = { slide = [0.1, 0.2] }, rows = [{ form = { turn = 1.0, cube = -1.0 }, lower = -1.0, upper = 1.0 }] }
placement = { rows = [{ form = { slide = 1.0, cube = 1.0 }, upper = 0.5 }] }
transfer = { keep = [{ slide = 1.0 }] }
transit = { keep = [{ cube = 1.0 }] }
"#;

const ARM: &str = r#"<robot name="arm">
  <link name="base"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/><limit lower="-2.5" upper="2.5" effort="1" velocity="1"/>
  </joint>
  <link name="upper"><collision><geometry><box size="1 2 3"/></geometry></collision></link>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="tip"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <link name="tip"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
</robot>"#;

const CUBE: &str = r#"<robot name="cube">
  <link name="rail"/>
  <joint name="cube" type="prismatic">
    <parent link="rail"/><child link="cube"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <link name="cube"><collision><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision></link>
</robot>"#;

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "`{from}` stands once in the text");
    text.replace(from, to)
}

/// The message has one line, ends in no dot, and contains every part.
fn assert_message(result: Result<Scene, scene::SceneError>, change: &str, parts: &[&str]) {
    let message = match result {
        Ok(_) => panic!("accepted: {change}"),
        Err(error) => error.to_string(),
    };
    for part in parts {
        assert!(message.contains(part), "`{change}` gives `{message}`, without `{part}`");
    }
    assert!(!message.contains('\n') && !message.ends_with('.'), "{message}");
}

/// The good scene with one change in `scene.toml` is refused, with a message that has all the `parts`.
#[track_caller]
fn refuses(from: &str, to: &str, parts: &[&str]) {
    let text = replaced(SCENE, from, to);
    let result = Scene::from_text(&text, &[("arm.urdf", ARM), ("cube.urdf", CUBE)]);
    assert_message(result, to, &[&["scene.toml: "], parts].concat());
}

/// The same for the arm's URDF.
#[track_caller]
fn refuses_urdf(from: &str, to: &str, parts: &[&str]) {
    let text = replaced(ARM, from, to);
    let result = Scene::from_text(SCENE, &[("arm.urdf", &text), ("cube.urdf", CUBE)]);
    assert_message(result, to, parts);
}

#[track_caller]
fn accepts(from: &str, to: &str) -> Scene {
    let text = replaced(SCENE, from, to);
    match Scene::from_text(&text, &[("arm.urdf", ARM), ("cube.urdf", CUBE)]) {
        Ok(scene) => scene,
        Err(error) => panic!("refused `{to}`: {error}"),
    }
}

#[test]
fn the_good_scene_is_accepted() {
    let scene = accepts("format = 1", "format = 1");
    assert_eq!((scene.dim(), scene.bodies.len()), (3, 4));
    // upper-tip joined, tip-wall excluded: of 6 pairs 4 count.
    assert_eq!(scene.collision_pairs().len(), 4);
}

#[test]
fn version_of_the_format() {
    refuses("format = 1", "format = 2", &["format = 2", "reads format 1"]);
    refuses("format = 1\n", "\n", &["format = (missing)", "write `format = 1`"]);
    refuses("format = 1\n", "format = 7\nnovelty = 3\n", &["format = 7"]);
}

#[test]
fn text_that_is_no_scene() {
    refuses("xyz = [9.0, 0.0, 0.0]", "xyy = [9.0, 0.0, 0.0]", &["line 18", "unknown field `xyy`", "`xyz`"]);
    refuses("role = \"object\"", "role = \"thing\"", &["line 12", "unknown variant `thing`", "`object`"]);
    refuses("max_grasps = 4", "max_grasps = -4", &["max_grasps = -4", "line 30"]);
    refuses("max_grasps = 4\n", "", &["missing field `max_grasps`"]);
    refuses("[9.0, 0.0, 0.0]", "[9.0, 0.0]", &["xyz = [9.0, 0.0]"]);
    refuses("name = \"rig\"", "name = ", &["line 3", "name ="]);
    refuses("name = \"rig\"", "name = \"rig\"\nname = \"rig\"", &["line 4", "duplicate key"]);
}

#[test]
fn names() {
    refuses("name = \"rig\"", "name = \"../rig\"", &["name = \"../rig\"", "use letters"]);
    refuses("name = \"rig\"", "name = \"\"", &["name = \"\"", "use letters"]);
    refuses("name = \"arm\"", "name = \"cube\"", &["model[1].name = \"cube\"", "unique"]);
    refuses("name = \"wall\"", "name = \"arm\"", &["obstacle[0].name = \"arm\"", "unique"]);
    refuses("name = \"wall\"", "name = \"world\"", &["obstacle[0].name = \"world\"", "unique"]);
    refuses("name = \"wall\"", "name = \"a/b\"", &["obstacle[0].name = \"a/b\"", "use letters"]);
    refuses("[task.move]", "[task.\"a b\"]", &["task.a b = \"a b\"", "use letters"]);
}

#[test]
fn files_of_models() {
    refuses(
        "\"arm.urdf\"",
        "\"leg.urdf\"",
        &["model.arm.urdf = \"leg.urdf\"", "leg.urdf cannot be read", "correct the path"],
    );
    refuses("\"arm.urdf\"", "\"../arm.urdf\"", &["model.arm.urdf = \"../arm.urdf\"", "copy the file"]);
    refuses("\"arm.urdf\"", "\"/tmp/arm.urdf\"", &["model.arm.urdf", "copy the file"]);
    refuses("\"arm.urdf\"", "\"\"", &["model.arm.urdf = \"\"", "copy the file"]);
    accepts("\"arm.urdf\"", "\"./arm.urdf\"");
}

#[test]
fn a_missing_scene_names_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let message = Scene::load(folder.path()).unwrap_err().to_string();
    let path = folder.path().join("scene.toml");
    assert!(message.contains(path.to_str().unwrap()) && message.contains("give a scene folder"), "{message}");
    std::fs::write(&path, [b'a', 0xff]).unwrap();
    let message = Scene::load(folder.path()).unwrap_err().to_string();
    assert!(message.contains("byte 1 is not UTF-8"), "{message}");
    std::fs::write(&path, SCENE).unwrap();
    let message = Scene::load(folder.path()).unwrap_err().to_string();
    let urdf = folder.path().join("arm.urdf");
    assert!(message.contains(urdf.to_str().unwrap()) && message.contains("model.arm.urdf"), "{message}");
}

#[test]
fn numbers_are_finite() {
    let finite = "give a finite one";
    refuses("xyz = [9.0, 0.0, 0.0]", "xyz = [9.0, nan, 0.0]", &["obstacle.wall.xyz[1] = NaN", finite]);
    refuses("urdf = \"arm.urdf\"", "urdf = \"arm.urdf\"\nrpy = [0.0, 0.0, inf]", &["model.arm.rpy[2] = inf"]);
    refuses("turn = [-2.0, 2.0]", "turn = [-inf, 2.0]", &["coordinates.limits.turn = -inf", finite]);
    refuses("start = [0.0, 0.0", "start = [0.0, nan", &["task.move.start[1] = NaN", finite]);
    refuses("goal = [0.0, 0.0", "goal = [inf, 0.0", &["task.move.goal[0] = inf", finite]);
    refuses("clearance = 0.0", "clearance = nan", &["task.move.clearance = NaN", finite]);
    refuses("slide = [0.1, 0.2]", "slide = [nan, 0.2]", &["task.move.grasp.bounds.slide = NaN", finite]);
    refuses("upper = 1.0", "upper = inf", &["task.move.grasp.rows[0].upper = inf", finite]);
    refuses("{ turn = 1.0, ", "{ turn = nan, ", &["task.move.grasp.rows[0].form.turn = NaN", finite]);
    refuses(
        "keep = [{ slide = 1.0 }]",
        "keep = [{ slide = nan }]",
        &["task.move.transfer.keep[0].slide = NaN"],
    );
    refuses(
        "xyz = [9.0, 0.0, 0.0]",
        "xyz = [9e9, 0.0, 0.0]",
        &["obstacle.wall.xyz[0] = 9000000000", "metres"],
    );
    refuses_urdf(
        "<limit lower=\"-2.5\"",
        "<limit lower=\"nan\"",
        &["arm.urdf: joint \"turn\" limit lower = NaN"],
    );
    refuses_urdf(
        "xyz=\"0 0 1\" rpy",
        "xyz=\"0 nan 1\" rpy",
        &["arm.urdf: joint \"turn\" origin xyz[1] = NaN"],
    );
}

#[test]
fn sizes_are_positive() {
    let positive = "give a positive size";
    refuses("size = [1.0, 2.0, 3.0]", "size = [1.0, 0.0, 3.0]", &["obstacle.wall.box.size[1] = 0", positive]);
    for (shape, field) in [
        ("cylinder = { radius = 0.0, length = 1.0 }", "cylinder.radius = 0"),
        ("cylinder = { radius = 1.0, length = -1.0 }", "cylinder.length = -1"),
        ("sphere = { radius = 0.0 }", "sphere.radius = 0"),
        ("capsule = { radius = 1.0, length = 0.0 }", "capsule.length = 0"),
        ("capsule = { radius = nan, length = 1.0 }", "capsule.radius = NaN"),
    ] {
        refuses("box = { size = [1.0, 2.0, 3.0] }", shape, &["obstacle.wall.", field]);
    }
    refuses_urdf(
        "<sphere radius=\"0.1\"/>",
        "<sphere radius=\"0\"/>",
        &["arm.urdf: link \"tip\" collision[0] sphere radius = 0", positive],
    );
    refuses_urdf(
        "size=\"1 2 3\"",
        "size=\"1 2 0\"",
        &["arm.urdf: link \"upper\" collision[0] box size[2] = 0"],
    );
}

#[test]
fn an_obstacle_has_one_shape() {
    refuses("box = { size = [1.0, 2.0, 3.0] }\n", "", &["obstacle.wall has 0 of box", "give exactly one"]);
    refuses(
        "box = { size = [1.0, 2.0, 3.0] }\n",
        "sphere = { radius = 1 }\ncapsule = { radius = 1, length = 1 }\n",
        &["obstacle.wall has 2 of box"],
    );
}

#[test]
fn order_names_every_joint_once() {
    let order = "order = [\"turn\", \"slide\", \"cube\"]";
    refuses(
        order,
        "order = [\"turn\", \"slide\"]",
        &["coordinates.order: joint `cube`", "add \"cube\" to the order"],
    );
    refuses(
        order,
        "order = [\"turn\", \"slide\", \"cube\", \"arm/turn\"]",
        &["coordinates.order[3] = arm/turn: named twice"],
    );
    refuses(
        order,
        "order = [\"turn\", \"slid\", \"cube\"]",
        &["coordinates.order[1] = slid", "it has arm/turn, arm/slide, cube/cube"],
    );
    let scene = accepts(order, "order = [\"cube\", \"arm/turn\", \"slide\"]");
    assert_eq!(scene.coordinate_idx("arm/turn"), Some(1));
    assert_eq!(scene.coordinate_idx("turn"), None, "one spelling a scene");
    assert_eq!(scene.task(None).unwrap().transfer_keep[0].as_slice(), [0.0, 0.0, 1.0]);
}

#[test]
fn limits_narrow_those_of_the_urdf() {
    let limits = "turn = [-2.0, 2.0]";
    refuses(
        limits,
        "turn = [-2.6, 2.0]",
        &["coordinates.limits.turn = [-2.6, 2]", "inside the limits [-2.5, 2.5]", "narrow it"],
    );
    refuses(limits, "turn = [2.0, -2.0]", &["coordinates.limits.turn = [2, -2]", "exchange or widen"]);
    refuses(limits, "turn = [1.0, 1.0]", &["coordinates.limits.turn = [1, 1]", "exchange or widen"]);
    refuses(limits, "torn = [-2.0, 2.0]", &["coordinates.limits.torn = torn", "no such coordinate"]);
    refuses(
        limits,
        "turn = [-2.0, 2.0], \"arm/turn\" = [-1.0, 1.0]",
        &["coordinates.limits.turn", "named twice"],
    );
    assert_eq!(accepts("limits = { turn = [-2.0, 2.0] }\n", "").lower()[0], -2.5);
}

#[test]
fn revolute_ranges_lie_inside_pi() {
    let limit = "lower=\"-2.5\" upper=\"2.5\"";
    let wide = replaced(ARM, limit, "lower=\"-4\" upper=\"4\"");
    assert!(Scene::from_text(SCENE, &[("arm.urdf", &wide), ("cube.urdf", CUBE)]).is_ok(), "narrowed to 2");
    let text = replaced(SCENE, "turn = [-2.0, 2.0]", "turn = [-2.0, 3.1415926535897932]");
    let result = Scene::from_text(&text, &[("arm.urdf", &wide), ("cube.urdf", CUBE)]);
    assert_message(result, "pi", &["coordinates.limits.turn = [-2, 3.14159", "inside (-pi, pi)", "`limits`"]);
    let text = replaced(SCENE, "limits = { turn = [-2.0, 2.0] }", "");
    let result = Scene::from_text(&text, &[("arm.urdf", &wide), ("cube.urdf", CUBE)]);
    assert_message(result, "4", &["coordinates.order[0] \"turn\" = [-4, 4]", "inside (-pi, pi)"]);
}

#[test]
fn continuous_joints_need_limits() {
    let continuous = replaced(ARM, "type=\"revolute\"", "type=\"continuous\"");
    let urdf: [(&str, &str); 2] = [("arm.urdf", &continuous), ("cube.urdf", CUBE)];
    let text = replaced(SCENE, "limits = { turn = [-2.0, 2.0] }", "");
    assert_message(
        Scene::from_text(&text, &urdf),
        "continuous",
        &["scene.toml: coordinates.order[0] \"turn\"", "continuous joint `turn`", "limits = { \"turn\" ="],
    );
    let text = replaced(SCENE, "turn = [-2.0, 2.0]", "turn = [-3.0, 3.0]");
    assert_eq!(Scene::from_text(&text, &urdf).unwrap().lower()[0], -3.0, "wider than the URDF's limit");
}

#[test]
fn joints_and_shapes_that_are_not_supported() {
    for kind in ["floating", "spherical"] {
        refuses_urdf(
            "type=\"revolute\"",
            &format!("type=\"{kind}\""),
            &["of joint `turn` of model `arm`", &format!("arm.urdf: type = \"{kind}\""), "use three"],
        );
    }
    refuses_urdf("type=\"revolute\"", "type=\"screw\"", &["arm.urdf", "screw"]);
    refuses_urdf(
        "<axis xyz=\"1 0 0\"/>",
        "<axis xyz=\"1 0 0\"/><mimic joint=\"turn\" multiplier=\"2\"/>",
        &[
            "arm.urdf: type = \"mimic\" of joint `slide` of model `arm`",
            "not supported",
            "make the joint independent",
        ],
    );
    refuses_urdf(
        "<sphere radius=\"0.1\"/>",
        "<mesh filename=\"tip.stl\"/>",
        &[
            "arm.urdf: collision[0] of link `tip` of model `arm`",
            "mesh is not supported",
            "put boxes, cylinders, spheres",
        ],
    );
    refuses_urdf("<sphere radius=\"0.1\"/>", "<cone radius=\"0.1\"/>", &["arm.urdf", "cone"]);
}

#[test]
fn models_are_trees() {
    refuses_urdf(
        "<link name=\"base\"/>",
        "<link name=\"base\"/><link name=\"stray\"/>",
        &["arm.urdf: links: 2 links have no parent (base, stray)", "exactly one root"],
    );
    refuses_urdf("<link name=\"base\"/>", "<link name=\"upper\"/>", &["link name = \"upper\"", "unique"]);
    refuses_urdf(
        "<parent link=\"base\"/>",
        "<parent link=\"bass\"/>",
        &["arm.urdf: joint \"turn\" parent = \"bass\"", "correct the name"],
    );
    refuses_urdf(
        "<child link=\"tip\"/>",
        "<child link=\"upper\"/>",
        &["child = \"upper\"", "child of two joints"],
    );
    refuses_urdf(
        "<link name=\"base\"/>",
        "<link name=\"base\"/><link name=\"loop\"/><joint name=\"x\" type=\"fixed\"><parent link=\"loop\"/><child link=\"loop\"/></joint>",
        &["cycle through link `loop`"],
    );
    refuses_urdf("joint name=\"slide\"", "joint name=\"turn\"", &["joint name = \"turn\"", "unique"]);
    refuses_urdf("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"0 0 0\"/>", &["joint \"slide\" axis xyz", "not zero"]);
    refuses_urdf("lower=\"-1\" upper=\"1\"", "", &["arm.urdf: joint \"slide\" limit = [0, 0]", "widen"]);
    refuses_urdf(
        "xyz=\"0 0 1\" rpy",
        "xyz=\"0 0m 0 1\" rpy",
        &["arm.urdf", "xyz = \"0 0m 0 1\" is not three"],
    );
    refuses_urdf("<robot name=\"arm\">", "<robot name=\"arm\"", &["arm.urdf: not a URDF"]);
}

#[test]
fn a_scene_has_something_that_moves() {
    let text = "format = 1\nname = \"still\"\ncoordinates = { order = [] }";
    assert_message(Scene::from_text(text, &[]), "empty", &["coordinates.order = []", "add a model"]);
}

#[test]
fn exclusions_name_links() {
    let pair = "[\"arm/tip\", \"wall\"]";
    refuses(
        pair,
        "[\"arm/tap\", \"wall\"]",
        &["collision.exclude[0] = \"arm/tap\"", "there are arm/base, arm/upper, arm/tip, cube/rail"],
    );
    refuses(pair, "[\"wall\", \"wall\"]", &["collision.exclude[0] = \"wall\"", "two different"]);
    refuses(pair, "[\"wall\"]", &["line 25"]);
}

#[test]
fn start_and_goal_fit_the_scene_and_the_placement() {
    refuses(
        "start = [0.0, 0.0, -0.5]",
        "start = [0.0, -0.5]",
        &["task.move.start has 2 numbers, the scene has 3 coordinates"],
    );
    refuses(
        "start = [0.0, 0.0, -0.5]",
        "start = [2.1, 0.0, -0.5]",
        &["task.move.start[0] = 2.1: outside the placement space: turn lies in [-2, 2]", "widen `placement`"],
    );
    // slide + cube ≤ 0.5, met with equality by the goal of the good scene.
    refuses(
        "goal = [0.0, 0.0, 0.5]",
        "goal = [0.0, 0.0, 0.500001]",
        &[
            "task.move.goal = [0.0, 0.0, 0.500001]: outside the placement space: rows[0] has the value 0.500001",
        ],
    );
    refuses(
        "placement = {",
        "placement = { bounds = { cube = [-1.0, 0.4] },",
        &["task.move.goal[2] = 0.5: outside the placement space: cube lies in [-1, 0.4]"],
    );
}

#[test]
fn bounds_and_rows_of_spaces() {
    let bound = "slide = [0.1, 0.2]";
    refuses(bound, "slide = [0.2, 0.1]", &["task.move.grasp.bounds.slide = [0.2, 0.1]", "exchange"]);
    refuses(bound, "slide = [0.1, 1.1]", &["task.move.grasp.bounds.slide = [0.1, 1.1]", "[-1, 1]"]);
    refuses(bound, "elbow = [0.1, 0.2]", &["task.move.grasp.bounds.elbow = elbow", "no such coordinate"]);
    accepts(bound, "slide = [0.1, 0.1]");
    let row = "lower = -1.0, upper = 1.0";
    refuses(row, "lower = 1.0, upper = -1.0", &["task.move.grasp.rows[0] = [1, -1]", "exchange"]);
    refuses(&format!(", {row}"), "", &["task.move.grasp.rows[0]: the row has neither", "give at least one"]);
    let form = "form = { turn = 1.0, cube = -1.0 }";
    refuses(
        form,
        "form = { turn = 0.0 }",
        &["task.move.grasp.rows[0].form = {\"turn\": 0.0}", "form is zero"],
    );
    refuses(form, "form = {}", &["task.move.grasp.rows[0].form", "form is zero"]);
    refuses(form, "form = { elbow = 1.0 }", &["task.move.grasp.rows[0].form.elbow = elbow", "no such"]);
}

#[test]
fn spaces_that_are_empty() {
    let row = "lower = -1.0, upper = 1.0";
    // turn - cube lies in [-3, 3].
    refuses(
        row,
        "lower = 3.1",
        &[
            "task.move.grasp: grasp space CG is empty in the joint box: rows[0] cannot hold within the bounds",
            "widen its bounds or rows",
        ],
    );
    accepts(row, "lower = 3.0");
    refuses(
        "upper = 0.5 }]",
        "upper = 0.5 }, { form = { slide = 1.0, cube = 1.0 }, lower = 0.6 }]",
        &["task.move.placement: placement space CP is empty", "rows[0], rows[1] contradict each other"],
    );
}

#[test]
fn the_rest_of_a_task() {
    refuses("max_grasps = 4", "max_grasps = 0", &["task.move.max_grasps = 0", "give 1 or more"]);
    refuses("clearance = 0.0", "clearance = -0.1", &["task.move.clearance = -0.1", "at least 0"]);
    refuses("keep = [{ slide = 1.0 }]", "keep = [{}]", &["task.move.transfer.keep[0]", "form is zero"]);
    refuses("keep = [{ cube = 1.0 }]", "keep = [{ cub = 1.0 }]", &["task.move.transit.keep[0].cub = cub"]);
    let scene = accepts("transit = { keep = [{ cube = 1.0 }] }\n", "");
    assert_eq!(scene.task(None).unwrap().transit_keep[0].as_slice(), [0.0, 0.0, 1.0], "the object rests");
}

#[test]
fn choosing_a_task() {
    let urdf = [("arm.urdf", ARM), ("cube.urdf", CUBE)];
    let message = |scene: &Scene, name| scene.task(name).unwrap_err().to_string();
    let one = Scene::from_text(SCENE, &urdf).unwrap();
    assert_eq!(one.task(None).unwrap().name, "move");
    assert!(message(&one, Some("mvoe")).contains("task = \"mvoe\": the scene has no such task; it has move"));
    let head = SCENE.split("[task.move]").next().unwrap();
    let table = SCENE.split("[task.move]").nth(1).unwrap();
    let two = Scene::from_text(&format!("{SCENE}\n[task.back]{table}"), &urdf).unwrap();
    assert!(message(&two, None).contains("choose one by --task: back, move"));
    let none = Scene::from_text(head, &urdf).unwrap();
    assert!(message(&none, None).contains("the scene has none; add a table [task.NAME]"));
}
