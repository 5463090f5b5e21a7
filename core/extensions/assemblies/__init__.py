"""All ways to assemble a mechanism: which the start's numbers do not tell."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["exports"],
    commands={"assemblies": "command:ListAssemblies"},
    public={
        "Assembled": "assemble:Assembled",
        "Assemblies": "assembly_modes:Assemblies",
        "Assembly": "assembly_modes:Assembly",
        "assemble": "assemble:assemble",
        "find_assemblies": "assembly_modes:find_assemblies",
    },
)
