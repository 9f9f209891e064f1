//! What may be asked of the stages on the command line: options, and commands in their place.

use crate::failure::Failure;
use ipc_types::stage_name::StageName;
// The process layer names stages by this word.
pub use ipc_types::stage_name::StageName as Stage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The stages whose input depends on this one's output.
pub fn later_stages(stage: StageName) -> impl Iterator<Item = StageName> {
    StageName::ALL.into_iter().filter(move |other| *other > stage)
}

/// What a stage does, in a few words.
pub fn purpose(stage: StageName) -> &'static str {
    match stage {
        StageName::Decompose => "regions of CS_free",
        StageName::Certify => "certificates of the regions",
        StageName::Miqp => "grasp plan",
        StageName::Gcs => "transit and transfer paths",
    }
}

/// The stage of that name, as the user wrote it after `--stage`.
pub fn stage_from_name(name: &str) -> Result<StageName, Failure> {
    StageName::ALL.into_iter().find(|stage| stage.word() == name).ok_or_else(|| {
        Failure::bad_input(format!(
            "--stage: no stage is called '{name}'; the stages are decompose, certify, miqp and gcs"
        ))
    })
}

/// Options of stages as `key -> value`, from `--set` and from the options of `regrasp` that belong to one stage.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageOptions(pub BTreeMap<StageName, BTreeMap<String, String>>);

impl StageOptions {
    /// Reads `stage.key=value`.
    pub fn parse(items: &[String]) -> Result<StageOptions, Failure> {
        let mut options = StageOptions::default();
        for item in items {
            let wrong = || {
                Failure::bad_input(format!(
                    "--set {item}: expected stage.key=value, such as --set decompose.coverage=0.9"
                ))
            };
            let (name, value) = item.split_once('=').ok_or_else(wrong)?;
            let (stage, key) = name.split_once('.').ok_or_else(wrong)?;
            let key_is_word = key.starts_with(|c: char| c.is_ascii_alphabetic())
                && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
            if !key_is_word {
                return Err(wrong());
            }
            let stage = stage_from_name(stage)
                .map_err(|_| Failure::bad_input(format!("--set {item}: no stage is called '{stage}'; the stages are decompose, certify, miqp and gcs")))?;
            options.insert(stage, key, value);
        }
        Ok(options)
    }

    /// Sets an option; a later value replaces an earlier one.
    pub fn insert(&mut self, stage: StageName, key: &str, value: impl Into<String>) {
        self.0.entry(stage).or_default().insert(key.replace('-', "_"), value.into());
    }

    /// Adds options; those of `newer` win.
    pub fn extend(&mut self, newer: &StageOptions) {
        for (stage, pairs) in &newer.0 {
            for (key, value) in pairs {
                self.insert(*stage, key, value.clone());
            }
        }
    }

    /// Arguments of the stage's command line: `--key=value`, sorted by key.
    pub fn arguments(&self, stage: StageName) -> Vec<String> {
        let pairs = self.0.get(&stage).into_iter().flatten();
        pairs.map(|(key, value)| format!("--{}={value}", key.replace('_', "-"))).collect()
    }
}

/// Commands that replace stages: the words of each command line.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageCommands(pub BTreeMap<StageName, Vec<String>>);

impl StageCommands {
    /// Reads `name=command`; the command is split at white space, quotes keep words together.
    pub fn parse(items: &[String]) -> Result<StageCommands, Failure> {
        let mut commands = BTreeMap::new();
        for item in items {
            let (name, command) = item.split_once('=').ok_or_else(|| {
                Failure::bad_input(format!(
                    "--stage {item}: expected NAME=COMMAND, such as --stage gcs=./my-gcs"
                ))
            })?;
            let words = split_words(command)
                .ok_or_else(|| Failure::bad_input(format!("--stage {item}: a quote is not closed")))?;
            let program = words.first().ok_or_else(|| {
                Failure::bad_input(format!("--stage {item}: the command is empty; name a program"))
            })?;
            if !can_be_found(program) {
                return Err(Failure::bad_input(format!(
                    "--stage {item}: there is no program {program}; give the path of an executable, or the name of one in PATH"
                )));
            }
            commands.insert(stage_from_name(name)?, words);
        }
        Ok(StageCommands(commands))
    }
}

/// Whether a program is there: a path as it stands, a name in one of the folders of PATH.
fn can_be_found(program: &str) -> bool {
    if program.contains('/') {
        return Path::new(program).is_file();
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

/// Splits a command line at white space outside quotes; `None` if a quote is not closed.
fn split_words(command: &str) -> Option<Vec<String>> {
    let (mut words, mut word, mut quote, mut in_word) = (Vec::new(), String::new(), None, false);
    for c in command.chars() {
        match quote {
            Some(q) if c == q => quote = None,
            Some(_) => word.push(c),
            None if c == '"' || c == '\'' => {
                quote = Some(c);
                in_word = true;
            }
            None if c.is_whitespace() => {
                if in_word {
                    words.push(std::mem::take(&mut word));
                }
                in_word = false;
            }
            None => {
                word.push(c);
                in_word = true;
            }
        }
    }
    if in_word {
        words.push(word);
    }
    quote.is_none().then_some(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_become_arguments_in_order() {
        let items = ["miqp.max_grasps=12".to_string(), "miqp.gap=0.1".to_string(), "gcs.order=3".to_string()];
        let options = StageOptions::parse(&items).unwrap();
        assert_eq!(options.arguments(StageName::Miqp), ["--gap=0.1", "--max-grasps=12"]);
        assert_eq!(options.arguments(StageName::Gcs), ["--order=3"]);
        assert!(options.arguments(StageName::Certify).is_empty());
    }

    #[test]
    fn malformed_options_name_the_option_and_the_form() {
        for bad in ["coverage=0.9", "decompose.coverage", "paint.colour=red", "gcs.=1", "gcs.--x=1"] {
            let failure = StageOptions::parse(&[bad.to_string()]).unwrap_err();
            assert_eq!(failure.exit_code.code(), 2);
            assert!(failure.message.contains(bad), "{}", failure.message);
        }
    }

    #[test]
    fn commands_keep_quoted_words_together() {
        let commands = StageCommands::parse(&["gcs=sh 'my gcs.py' -v".to_string()]).unwrap();
        assert_eq!(commands.0[&StageName::Gcs], ["sh", "my gcs.py", "-v"]);
        for bad in ["gcs", "gcs=", "gcs='x", "paint=sh", "gcs=/none/at/all", "gcs=no-such-program"] {
            assert_eq!(StageCommands::parse(&[bad.to_string()]).unwrap_err().exit_code.code(), 2);
        }
    }

    #[test]
    fn later_stages_follow_the_data() {
        assert_eq!(later_stages(StageName::Certify).collect::<Vec<_>>(), [StageName::Miqp, StageName::Gcs]);
        assert_eq!(later_stages(StageName::Gcs).count(), 0);
    }
}
