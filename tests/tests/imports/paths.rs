//! Finds paths in code: in `use` trees, and in the tokens of macros and attributes.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::iter::Peekable;
use syn::{UseTree, Visibility};

/// Names of a path, from first to last. `$crate` is `crate`.
pub(crate) type Path = Vec<String>;

/// One name that a `use` brings into scope.
pub(crate) struct Use {
    /// The name; none for `*`, which brings every name of the module at `path` into scope.
    pub(crate) name: Option<String>,
    pub(crate) path: Path,
    /// True if other modules can import the name from here.
    pub(crate) is_public: bool,
}

/// Returns the names that a `use` brings into scope.
pub(crate) fn uses(tree: &UseTree, visibility: &Visibility) -> Vec<Use> {
    let mut found = Vec::new();
    leaves(tree, &mut Vec::new(), !matches!(visibility, Visibility::Inherited), &mut found);
    found
}

fn leaves(tree: &UseTree, prefix: &mut Path, is_public: bool, found: &mut Vec<Use>) {
    let mut leaf = |last: Option<String>, name: Option<String>| {
        let path = prefix.iter().cloned().chain(last.filter(|last| last != "self" || prefix.is_empty())).collect();
        found.push(Use { name, path, is_public });
    };
    match tree {
        UseTree::Path(part) => {
            prefix.push(part.ident.to_string());
            leaves(&part.tree, prefix, is_public, found);
            prefix.pop();
        }
        UseTree::Group(group) => group.items.iter().for_each(|tree| leaves(tree, prefix, is_public, found)),
        UseTree::Glob(_) => leaf(None, None),
        UseTree::Rename(it) => leaf(Some(it.ident.to_string()), Some(it.rename.to_string())),
        UseTree::Name(it) if it.ident == "self" => leaf(None, prefix.last().cloned()),
        UseTree::Name(it) => leaf(Some(it.ident.to_string()), Some(it.ident.to_string())),
    }
}

/// A path in tokens, and true if it names a macro that is called.
pub(crate) type Named = (Path, bool);

/// Returns every path in the tokens of a macro or an attribute.
pub(crate) fn in_tokens(tokens: &TokenStream) -> Vec<Named> {
    let mut found = Vec::new();
    walk(tokens, &[], &mut found);
    found
}

/// Returns the paths that are strings in an attribute, as in `#[serde(with = "crate::a")]`.
pub(crate) fn in_strings(tokens: &TokenStream) -> Vec<Named> {
    let of = |token| match token {
        TokenTree::Literal(literal) => {
            let text = literal.to_string();
            let path = text.trim_matches('"').split("::").map(str::to_owned).collect::<Path>();
            let is_path = path.len() > 1 && path.iter().all(|name| syn::parse_str::<syn::PathSegment>(name).is_ok());
            if is_path { vec![(path, false)] } else { Vec::new() }
        }
        TokenTree::Group(group) => in_strings(&group.stream()),
        _ => Vec::new(),
    };
    tokens.clone().into_iter().flat_map(of).collect()
}

fn walk(tokens: &TokenStream, prefix: &[String], found: &mut Vec<Named>) {
    let mut tokens = tokens.clone().into_iter().peekable();
    // `before` is the last token, if it shows that the next word is not a path but a field, a lifetime or a variable of
    // the macro.
    let mut before = ' ';
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Ident(word) if ".'".contains(before) || before == '$' && word != "crate" => before = ' ',
            TokenTree::Ident(word) => {
                path([prefix, &[word.to_string()]].concat(), &mut tokens, found);
                before = ' ';
            }
            TokenTree::Group(group) => {
                walk(&group.stream(), prefix, found);
                before = ' ';
            }
            // Two dots are a range, or stand for the remaining fields of a struct.
            TokenTree::Punct(mark) => {
                before = if (before, mark.as_char()) == ('.', '.') { ' ' } else { mark.as_char() }
            }
            TokenTree::Literal(_) => before = ' ',
        }
    }
}

/// Reads the rest of a path that begins with `names`.
fn path(mut names: Path, tokens: &mut Peekable<impl Iterator<Item = TokenTree> + Clone>, found: &mut Vec<Named>) {
    let mark = |token: Option<&TokenTree>, mark: char| match token {
        Some(TokenTree::Punct(punct)) => punct.as_char() == mark,
        _ => false,
    };
    loop {
        let mut ahead = tokens.clone();
        if !(mark(ahead.next().as_ref(), ':') && mark(ahead.next().as_ref(), ':')) {
            break;
        }
        match ahead.next() {
            Some(TokenTree::Ident(word)) => names.push(word.to_string()),
            // The tokens are a tree of paths, such as crate::{a, b::c}.
            Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                *tokens = ahead;
                return walk(&group.stream(), &names, found);
            }
            _ => break,
        }
        *tokens = ahead;
    }
    let is_call = mark(tokens.peek(), '!');
    found.push((names, is_call));
}
