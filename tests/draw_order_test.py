"""Random numbers are drawn in one order by every compiler: no two draws lie in the arguments of one call, nor in the
operands of one operator, which C++ leaves unsequenced (GCC takes a call's last argument first on x86-64, the first on ARM).

    python tests/draw_order_test.py
"""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ("src", "include", "python", "bench", "fuzz", "examples", "tools", "tests")
IGNORED = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.*?)\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|^\s*#[^\n]*(?:\\\n[^\n]*)*',
                     re.DOTALL | re.MULTILINE)
TOKEN = re.compile(r"\w+|->|<<|>>|&&|\|\||[-+*/%|&^<>=!]=|::|\S")
OPENING = {"(": ")", "[": "]", "{": "}"}
GENERATOR = re.compile(r"\bRng\s*&?\s+(\w+)|\bRng&\s*(\w+)")
LAMBDA = re.compile(r"\bauto (\w+)\s*=\s*\[[^\]]*\]")
TEMPLATE = re.compile(r"(?<=\w)<[\w:\s,*&<>]*?>+(?=[\s({>:,)&])")  # its brackets are no operators, which stand between spaces
MEMBER = re.compile(r"(\w+)\s*\([^(){};]*\)\s*(?:const\s*)?\{")
# What is left of one of these is evaluated before what is right of it, or after it: always the same. The comma of a call
# and other operators say nothing.
SEQUENCED = {"&&", "||", "?", ":", "<<", ">>", "=", "+=", "-=", "*=", "/=", "%=", "|=", "&=", "^=", "return"}
UNSEQUENCED = {"+", "-", "*", "/", "%", "<", ">", "<=", ">=", "==", "!=", "&", "|", "^"}
CONTROL = {"for", "if", "while", "switch", "catch"}
NO_FUNCTION = CONTROL | {"TEST", "TEST_F", "TEST_P"}


def blanked(text):
    """The text without comments, strings, directives and template arguments; lines keep their numbers."""
    plain = IGNORED.sub(lambda found: '""' + "\n" * found[0].count("\n"), text)
    return TEMPLATE.sub(lambda found: "\n" * found[0].count("\n"), plain)


def body_end(text, start):
    """Behind the bracket that closes the one at `start`."""
    depth = 0
    for place in range(start, len(text)):
        depth += (text[place] == "{") - (text[place] == "}")
        if depth == 0:
            return place
    return len(text)


def drawing_names(text, declared=""):
    """(names of generators, names of functions that draw from one that their caller does not name).

    declared: the header that the text's members are declared in.
    """
    generators = {a or b for a, b in GENERATOR.findall(text)} | {"rng", "rng_"}
    bodies = []  # of functions: name, text, what draws there
    for found in LAMBDA.finditer(text):
        start = text.find("{", found.end())
        if "Rng" not in text[found.end():start]:
            bodies.append((found[1], text[start:body_end(text, start)], generators))
    for source in (text, declared):
        for found in MEMBER.finditer(source):
            if found[1] not in NO_FUNCTION and not found[1].endswith("_"):
                bodies.append((found[1], source[found.end():body_end(source, found.end() - 1)], {"rng_"}))
    drawing = set()
    while True:
        calls = rf"\b(?:{'|'.join(sorted(drawing))})\(" if drawing else "$^"
        more = {name for name, body, words in bodies
                if re.search(rf"\b(?:{'|'.join(sorted(words))})\b|{calls}", body)} - drawing
        if not more:
            return generators, drawing
        drawing |= more


def tree(tokens):
    """Nested lists: a token is (text, line), a bracket [opening token, contents...]."""
    root = [("{", 1)]
    open_ones = [root]
    for token in tokens:
        if token[0] in OPENING:
            group = [token]
            open_ones[-1].append(group)
            open_ones.append(group)
        elif token[0] in OPENING.values():
            if len(open_ones) > 1:
                open_ones.pop()
        else:
            open_ones[-1].append(token)
    return root


def split(nodes, separators):
    parts = [[]]
    for node in nodes:
        if isinstance(node, tuple) and node[0] in separators:
            parts.append([])
        else:
            parts[-1].append(node)
    return parts


def text_of(node):
    return node[0] if isinstance(node, tuple) else node[0][0]


class Finder:
    """Walks the brackets of one file and keeps the lines with two draws whose order is open."""

    def __init__(self, text, declared=""):
        text = blanked(text)
        self.generators, self.drawing = drawing_names(text, blanked(declared))
        tokens = [(found[0], line) for line, row in enumerate(text.split("\n"), 1) for found in TOKEN.finditer(row)]
        self.lines = []
        self.contents(tree(tokens), False)

    def draws_itself(self, nodes, index):
        """Whether the word at `index` is a draw, or hands a generator on."""
        word = text_of(nodes[index])
        before = text_of(nodes[index - 1]) if index else ""
        if word in self.generators:
            declared = before == "Rng" or (before == "&" and index > 1 and text_of(nodes[index - 2]) == "Rng")
            return not declared
        called = index + 1 < len(nodes) and text_of(nodes[index + 1]) == "("
        declared = before in (">", "::", "&") or re.match(r"\w", before) and before not in ("return", "else")
        return word in self.drawing and called and not declared

    def operand(self, nodes):
        """Whether any draw is made in what holds no separator any more."""
        found = False
        for index, node in enumerate(nodes):
            if isinstance(node, tuple):
                found |= self.draws_itself(nodes, index)
                continue
            before = nodes[index - 1] if index else ("", 0)
            capture = text_of(node) == "[" and (not index or (isinstance(before, tuple) and not re.match(r"\w", before[0])))
            called = not isinstance(before, tuple) or re.match(r"\w|>", before[0])
            inside = self.contents(node, not called or text_of(before) in CONTROL)
            found |= inside and not capture
        return found

    def expression(self, nodes):
        """Whether it draws; keeps the line where two operands of one operator do."""
        found = False
        for part in split(nodes, SEQUENCED):
            drawing = [operand for operand in split(part, UNSEQUENCED) if self.operand_in(operand, part)]
            if len(drawing) > 1:
                self.lines.append(self.line_of(part))
            found |= bool(drawing)
        return found

    def operand_in(self, operand, part):
        # `Rng& rng` is a declaration, though & parts it.
        if len(operand) == 1 and text_of(operand[0]) in self.generators and operand[0] is not part[0]:
            place = next(i for i, node in enumerate(part) if node is operand[0])
            if place > 1 and text_of(part[place - 1]) == "&" and text_of(part[place - 2]) == "Rng":
                return False
        return self.operand(operand)

    def line_of(self, nodes):
        node = nodes[0]
        while isinstance(node, list):
            node = node[0]
        return node[1]

    def contents(self, group, ordered):
        """Whether what is evaluated together with the bracket draws."""
        inside = group[1:]
        statements = split(inside, {";"})
        parts = [part for statement in statements for part in split(statement, {","})]
        drawing = [part for part in parts if self.expression(part)]
        if text_of(group) == "{":  # of a block nothing is drawn here, and a list in braces has its order
            return bool(drawing) and len(statements) == 1
        # A generator handed on draws in the call itself, after all arguments. The commas of a bracket that is no call's
        # are operators, which have their order.
        early = [part for part in drawing if not (len(part) == 1 and text_of(part[0]) in self.generators)]
        if len(early) > 1 and not ordered:
            self.lines.append(self.line_of(group))
        return bool(drawing)


def open_orders(text, declared=""):
    """Lines of C++ text where the order of draws is the compiler's choice."""
    return sorted(set(Finder(text, declared).lines))


def source_files():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".cpp", ".hpp") and path.is_file():
                yield path


MEMBERS = "class Room { double uniform(double a, double b) { return rng_.uniform(a, b); } };"
MEMBERS_OPEN = """
Vec2 Room::half() { return Vec2(uniform(1, 2), uniform(1, 2)); }
void Room::fill() { const auto f = [&] { return 2 * uniform(1, 2); }; add(f(), f()); }
"""
OPEN = """
Vec3 p(rng.normal(), 0, rng.normal());
put(mesh, any(rng), other(rng));
return turned(0, rng.uniform(-0.1, 0.25), (left ? 1 : -1) * rng.uniform(0, 1));
const double v = rng.normal() * std::exp(rng.uniform(0, 1));
const Vec2 c = at + rng.uniform(0, 1) * a + rng.normal() * b;
points.emplace_back(static_cast<float>(rng.uniform(0, 1)), static_cast<float>(rng.below(2)));
Rng setup(3); paint(setup.below(3), setup.below(4));
const auto some = [&] { return rng.normal(); }; pair(some(), some());
if (ready) move(pick(ids, rng), Vec3(rng.normal(), 0, 0));
const auto make = [&](Rng& own) { return pair(own.below(2), own.below(3)); };
"""
SETTLED = """
Vec3 p = {rng.normal(), rng.normal(), rng.normal()};
const double x = rng.normal(), y = rng.normal();
for (int i = rng.below(3), k = rng.below(4); i < k; ++i) draw(rng);
if (rng.uniform() < 0.3 && rng.uniform() < 0.4) return;
const double u = rng.uniform() < 0.2 ? rng.uniform(0, 1) : rng.normal();
fill(image, u, v, rng);
fill(size_of(rng), rng);
stream << rng.below(2) << rng.below(3);
twist = (Vec6() << some(), some(), rng.normal()).finished();
Mesh lump(MaterialId material, Rng& rng) { return Mesh{rng.below(2), rng.below(3)}; }
run([&rng](int i) { return rng.below(i); }, [&rng](int i) { return rng.below(i + 1); });
// two(rng.below(2), rng.below(3))
say("two(rng.below(2), rng.below(3))", 'x');
"""


class Finding(unittest.TestCase):
    def test_every_kind_of_open_order_is_found(self):
        for line in OPEN.strip().split("\n"):
            self.assertEqual(open_orders(line), [1], line)

    def test_so_are_those_of_members_that_the_header_declares(self):
        for line in MEMBERS_OPEN.strip().split("\n"):
            self.assertEqual(open_orders(line, MEMBERS), [1], line)

    def test_what_has_an_order_is_no_fault(self):
        for line in SETTLED.strip().split("\n"):
            self.assertEqual(open_orders(line), [], line)


class Sources(unittest.TestCase):
    def test_no_order_of_draws_is_left_to_the_compiler(self):
        faults = []
        for path in source_files():
            header = path.with_suffix(".hpp")
            declared = header.read_text(encoding="utf-8") if path.suffix == ".cpp" and header.is_file() else ""
            text = path.read_text(encoding="utf-8")
            if "Rng" in text + declared:
                faults += [f"{path.relative_to(ROOT)}:{line}" for line in open_orders(text, declared)]
        self.assertEqual(faults, [], "draws whose order is the compiler's choice: give each a name, in the order wanted")


if __name__ == "__main__":
    unittest.main()
