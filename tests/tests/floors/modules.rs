//! The modules of a crate: what each defines, imports and names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::tokens::{group, is_name, item, parts, tokens};

/// A path as its words; the first may be `crate`, `self` or `super`.
pub type Name = Vec<String>;

/// Text of a file, if there is such a file.
pub type Read<'a> = &'a dyn Fn(&Path) -> Option<String>;

/// Keywords before the name of an item.
const ITEMS: [&str; 8] = ["fn", "struct", "enum", "union", "trait", "type", "const", "static"];

/// A module, in a file of its own or in that of its parent.
#[derive(Default)]
pub struct Module {
    pub file: PathBuf,
    pub parent: Option<usize>,
    /// Whether only tests of the crate have it.
    pub test: bool,
    pub children: BTreeMap<String, usize>,
    /// What is defined here.
    pub items: BTreeSet<String>,
    /// What `use` brings, by the name that it has here.
    pub imports: BTreeMap<String, Vec<Name>>,
    /// Modules of which `use` brings everything.
    pub globs: BTreeSet<Name>,
    /// Paths of `use`, and paths of two words or more in code.
    pub paths: BTreeSet<Name>,
    /// Single words in code.
    pub words: BTreeSet<String>,
}

/// The modules of a crate by number, the root first.
pub struct Modules {
    pub all: Vec<Module>,
    /// Files whose text is put into that of a module.
    pub included: BTreeSet<PathBuf>,
}

impl Modules {
    /// Reads a crate from its root file on.
    ///
    /// # Panics
    /// If a file of a module is missing.
    pub fn of(root: &Path, read: Read) -> Self {
        let root_module = Module { file: root.to_owned(), ..Module::default() };
        let mut modules = Self { all: vec![root_module], included: BTreeSet::new() };
        modules.add_file(0, root.parent().unwrap(), read);
        modules
    }

    /// Takes in the file of a module; the files of its children are in `folder`.
    fn add_file(&mut self, module: usize, folder: &Path, read: Read) {
        let path = &self.all[module].file;
        let text = read(path).unwrap_or_else(|| panic!("{} is missing", path.display()));
        Scan { modules: self, module, folder, read, file: None }.run(&tokens(&text), true);
    }

    fn add(&mut self, parent: usize, name: &str, file: PathBuf) -> usize {
        let number = self.all.len();
        self.all.push(Module { file, parent: Some(parent), ..Module::default() });
        self.all[parent].children.insert(name.to_owned(), number);
        number
    }
}

/// The reading of a module's tokens.
struct Scan<'a> {
    modules: &'a mut Modules,
    module: usize,
    folder: &'a Path,
    read: Read<'a>,
    /// What `#[path]` says of the next module.
    file: Option<String>,
}

impl Scan<'_> {
    fn here(&mut self) -> &mut Module {
        &mut self.modules.all[self.module]
    }

    /// Takes in tokens of the module; `outside` of bodies they define its items.
    fn run(&mut self, tokens: &[&str], outside: bool) {
        let mut at = 0;
        while at < tokens.len() {
            let rest = &tokens[at..];
            at += match rest {
                ["#", "[", ..] => self.attribute(rest),
                ["#", "!", "[", ..] => 2 + group(&rest[2..]),
                ["mod", name, ";", ..] => self.file(name),
                ["mod", name, "{", ..] => self.inline(name, &rest[2..]),
                ["use", next, ..] if *next != "<" => self.tree(rest),
                ["include", "!", "(", text, ")", ..] => self.include(text, outside),
                ["macro_rules", "!", name, ..] => self.define(name, 3),
                // Whatever a macro makes may be an item.
                [name, "!", "{" | "(", ..] if outside && is_name(name) => {
                    self.here().words.insert((*name).to_owned());
                    self.inner(&rest[2..], true) + 2
                }
                [kind, name, ..] if outside && ITEMS.contains(kind) && is_name(name) && !ITEMS.contains(name) => {
                    self.define(name, 2)
                }
                ["{" | "(" | "[", ..] => self.inner(rest, false),
                // A field, a method, or what is behind generic arguments.
                ["." | "::", next, ..] if is_name(next) => 2,
                [first, ..] if is_name(first) => self.path(rest),
                _ => 1,
            };
        }
    }

    /// A group at the start of `tokens`.
    fn inner(&mut self, tokens: &[&str], outside: bool) -> usize {
        let length = group(tokens);
        self.run(&tokens[1..length - 1], outside);
        length
    }

    fn define(&mut self, name: &str, length: usize) -> usize {
        self.here().items.insert(name.to_owned());
        length
    }

    /// An attribute, and the item behind it if only tests have it.
    fn attribute(&mut self, tokens: &[&str]) -> usize {
        let length = 1 + group(&tokens[1..]);
        match &tokens[2..length - 1] {
            ["path", "=", text] => self.file = Some(text.trim_matches('"').to_owned()),
            ["test"] => return length + self.test(&tokens[length..]),
            ["cfg", condition @ ..] if condition.contains(&"test") && !condition.contains(&"not") => {
                return length + self.test(&tokens[length..]);
            }
            _ => {}
        }
        length
    }

    /// An item of tests. Its modules are known, but what they name does not count.
    fn test(&mut self, tokens: &[&str]) -> usize {
        let length = item(tokens);
        let first = self.modules.all.len();
        if tokens[..length].iter().take_while(|token| **token != "{").any(|token| *token == "mod") {
            self.run(&tokens[..length], true);
        }
        self.modules.all[first..].iter_mut().for_each(|module| module.test = true);
        length
    }

    /// `mod name;`
    fn file(&mut self, name: &str) -> usize {
        let (path, folder) = if let Some(file) = self.file.take() {
            let path = self.here().file.parent().unwrap().join(file);
            let folder = path.parent().unwrap().to_owned();
            (path, folder)
        } else {
            let (flat, folder) = (self.folder.join(name).with_extension("rs"), self.folder.join(name));
            (if (self.read)(&flat).is_some() { flat } else { folder.join("mod.rs") }, folder)
        };
        let child = self.modules.add(self.module, name, path);
        self.modules.add_file(child, &folder, self.read);
        3
    }

    /// `mod name { … }`, from its bracket on.
    fn inline(&mut self, name: &str, tokens: &[&str]) -> usize {
        let file = self.here().file.clone();
        let module = self.modules.add(self.module, name, file);
        let folder = self.folder.join(name);
        let mut inner = Scan { modules: self.modules, module, folder: &folder, read: self.read, file: None };
        inner.inner(tokens, true) + 2
    }

    /// `include!("…")`
    fn include(&mut self, text: &str, outside: bool) -> usize {
        let path = self.here().file.parent().unwrap().join(text.trim_matches('"'));
        // What a build script makes is no file of the repository.
        if let Some(text) = (self.read)(&path) {
            self.run(&tokens(&text), outside);
            self.modules.included.insert(path);
        }
        5
    }

    /// `use …;`
    fn tree(&mut self, tokens: &[&str]) -> usize {
        let length = tokens.iter().position(|token| *token == ";").unwrap_or(tokens.len());
        self.branch(&[], &tokens[1..length]);
        length
    }

    /// A part of a tree of `use`, below `stem`.
    fn branch(&mut self, stem: &[String], tree: &[&str]) {
        let with = |word: &str| [stem, &[word.to_owned()]].concat();
        match tree {
            ["{", inner @ .., "}"] => parts(inner).into_iter().for_each(|part| self.branch(stem, part)),
            ["*"] => {
                self.here().globs.insert(stem.to_vec());
            }
            ["self", rest @ ..] if !stem.is_empty() => self.bring(stem.to_vec(), rest),
            [first, "::", rest @ ..] => self.branch(&with(first), rest),
            [first, rest @ ..] if is_name(first) => self.bring(with(first), rest),
            // Of another crate, or nothing behind the last comma.
            _ => {}
        }
    }

    /// A path that `use` brings, under its last word or another name.
    fn bring(&mut self, path: Name, rest: &[&str]) {
        let name = if let ["as", name] = rest { (*name).to_owned() } else { path.last().unwrap().clone() };
        self.here().paths.insert(path.clone());
        self.here().imports.entry(name).or_default().push(path);
    }

    /// A word or a path in code.
    fn path(&mut self, tokens: &[&str]) -> usize {
        let mut path = vec![tokens[0].to_owned()];
        while let ["::", next, ..] = &tokens[2 * path.len() - 1..]
            && is_name(next)
        {
            path.push((*next).to_owned());
        }
        let length = 2 * path.len() - 1;
        if length > 1 {
            self.here().paths.insert(path);
        } else {
            self.here().words.extend(path);
        }
        length
    }
}
