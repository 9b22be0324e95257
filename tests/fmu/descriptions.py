"""Model descriptions written by hand, of FMI 2.0 and FMI 3.0: a pendulum with a torque, a mode and a constant."""
# ruff: noqa: E501  # one variable of a document a line

from __future__ import annotations

SECOND = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="pendulum" guid="{8c4e810f}" description="a pendulum"
    generationTool="by hand" generationDateAndTime="2026-11-25T08:00:00Z" variableNamingConvention="structured"
    numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="pendulum" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
      providesDirectionalDerivative="true">
    <SourceFiles>
      <File name="pendulum.c"/>
    </SourceFiles>
  </ModelExchange>
  <CoSimulation modelIdentifier="pendulum" canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true">
    <SourceFiles>
      <File name="pendulum.c"/>
    </SourceFiles>
  </CoSimulation>
  <UnitDefinitions>
    <Unit name="rad">
      <BaseUnit rad="1"/>
      <DisplayUnit name="deg" factor="57.29577951308232"/>
    </Unit>
    <Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
    <Unit name="rad/s^2"><BaseUnit s="-2" rad="1"/></Unit>
    <Unit name="N m"><BaseUnit kg="1" m="2" s="-2"/></Unit>
    <Unit name="kg"><BaseUnit kg="1"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Angle"><Real quantity="Angle" unit="rad" displayUnit="deg"/></SimpleType>
    <SimpleType name="Mode">
      <Enumeration><Item name="free" value="1"/><Item name="locked" value="2"/></Enumeration>
    </SimpleType>
  </TypeDefinitions>
  <LogCategories>
    <Category name="logEvents" description="events"/>
    <Category name="logStatusError"/>
  </LogCategories>
  <DefaultExperiment startTime="0" stopTime="2" tolerance="1e-6" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="time" valueReference="0" causality="independent" variability="continuous">
      <Real unit="s"/>
    </ScalarVariable>
    <ScalarVariable name="mass" valueReference="1" causality="parameter" variability="tunable" initial="exact">
      <Real start="2" min="0" max="10" unit="kg"/>
    </ScalarVariable>
    <ScalarVariable name="torque" valueReference="2" causality="input" variability="continuous">
      <Real start="0" unit="N m"/>
    </ScalarVariable>
    <ScalarVariable name="joint.angle" valueReference="3" causality="local" variability="continuous" initial="exact">
      <Real declaredType="Angle" start="0.5" nominal="1" reinit="true"/>
    </ScalarVariable>
    <ScalarVariable name="joint.rate" valueReference="4" causality="output" variability="continuous" initial="exact">
      <Real start="0" unit="rad/s"/>
    </ScalarVariable>
    <ScalarVariable name="der(joint.angle)" valueReference="5" causality="local" variability="continuous" initial="calculated">
      <Real unit="rad/s" derivative="4"/>
    </ScalarVariable>
    <ScalarVariable name="der(joint.rate)" valueReference="6" causality="local" variability="continuous" initial="calculated">
      <Real unit="rad/s^2" derivative="5"/>
    </ScalarVariable>
    <ScalarVariable name="reaction" valueReference="7" causality="output" variability="continuous" initial="calculated">
      <Real unit="N m"/>
    </ScalarVariable>
    <ScalarVariable name="mode" valueReference="0" causality="local" variability="discrete" initial="exact">
      <Enumeration declaredType="Mode" start="1"/>
    </ScalarVariable>
    <ScalarVariable name="weight" valueReference="8" causality="calculatedParameter" variability="tunable" initial="calculated">
      <Real/>
    </ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="5" dependencies="5" dependenciesKind="constant"/>
      <Unknown index="8" dependencies="3 4 5" dependenciesKind="fixed dependent dependent"/>
    </Outputs>
    <Derivatives>
      <Unknown index="6" dependencies="5" dependenciesKind="constant"/>
      <Unknown index="7" dependencies="3 4" dependenciesKind="tunable dependent"/>
    </Derivatives>
    <InitialUnknowns>
      <Unknown index="6" dependencies="5"/>
      <Unknown index="7" dependencies="2 3 4"/>
      <Unknown index="8" dependencies="2 3 4 5"/>
      <Unknown index="10" dependencies="2" dependenciesKind="constant"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

THIRD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="pendulum" instantiationToken="{8c4e810f}" description="a pendulum"
    generationTool="by hand" generationDateAndTime="2026-11-25T08:00:00Z" variableNamingConvention="structured">
  <ModelExchange modelIdentifier="pendulum" canGetAndSetFMUState="true" canSerializeFMUState="true"
      providesDirectionalDerivatives="true" providesAdjointDerivatives="true" needsCompletedIntegratorStep="true"/>
  <CoSimulation modelIdentifier="pendulum" canHandleVariableCommunicationStepSize="true" fixedInternalStepSize="0.001"
      hasEventMode="true" recommendedIntermediateInputSmoothness="1"/>
  <UnitDefinitions>
    <Unit name="rad">
      <BaseUnit rad="1"/>
      <DisplayUnit name="deg" factor="57.29577951308232"/>
    </Unit>
    <Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
    <Unit name="rad/s^2"><BaseUnit s="-2" rad="1"/></Unit>
    <Unit name="N m"><BaseUnit kg="1" m="2" s="-2"/></Unit>
    <Unit name="kg"><BaseUnit kg="1"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Angle" quantity="Angle" unit="rad" displayUnit="deg"/>
    <EnumerationType name="Mode">
      <Item name="free" value="1"/>
      <Item name="locked" value="2"/>
    </EnumerationType>
  </TypeDefinitions>
  <LogCategories>
    <Category name="logEvents" description="events"/>
    <Category name="logStatusError"/>
  </LogCategories>
  <DefaultExperiment startTime="0" stopTime="2" tolerance="1e-6" stepSize="0.01"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous" unit="s"/>
    <Float64 name="mass" valueReference="1" causality="parameter" variability="tunable" initial="exact" start="2" min="0" max="10" unit="kg">
      <Alias name="m"/>
    </Float64>
    <Float64 name="torque" valueReference="2" causality="input" variability="continuous" start="0" unit="N m"/>
    <Float64 name="joint.angle" valueReference="3" causality="local" variability="continuous" initial="exact" declaredType="Angle" start="0.5" nominal="1" reinit="true"/>
    <Float64 name="joint.rate" valueReference="4" causality="output" variability="continuous" initial="exact" start="0" unit="rad/s"/>
    <Float64 name="der(joint.angle)" valueReference="5" causality="local" variability="continuous" initial="calculated" unit="rad/s" derivative="3"/>
    <Float64 name="der(joint.rate)" valueReference="6" causality="local" variability="continuous" initial="calculated" unit="rad/s^2" derivative="4"/>
    <Float64 name="reaction" valueReference="7" causality="output" variability="continuous" initial="calculated" unit="N m"/>
    <Enumeration name="mode" valueReference="8" causality="local" variability="discrete" initial="exact" declaredType="Mode" start="1"/>
    <Float64 name="weight" valueReference="9" causality="calculatedParameter" variability="tunable" initial="calculated"/>
    <Float64 name="'stop reached'" valueReference="10" causality="local" variability="continuous" initial="calculated"/>
    <UInt64 name="size" valueReference="11" causality="structuralParameter" variability="fixed" start="3"/>
    <Float64 name="force" valueReference="12" causality="parameter" variability="fixed" start="0 0 0">
      <Dimension valueReference="11"/>
    </Float64>
    <Clock name="clock" valueReference="13" causality="input" variability="discrete" intervalVariability="constant" intervalDecimal="0.1"/>
    <Float64 name="held" valueReference="14" causality="local" variability="discrete" clocks="13" previous="15" initial="calculated"/>
    <Float64 name="'previous held'" valueReference="15" causality="local" variability="discrete" initial="exact" start="0"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="4" dependencies="4" dependenciesKind="constant"/>
    <Output valueReference="7" dependencies="1 2 3 4" dependenciesKind="dependent fixed dependent dependent"/>
    <ContinuousStateDerivative valueReference="5" dependencies="4" dependenciesKind="constant"/>
    <ContinuousStateDerivative valueReference="6" dependencies="1 2 3" dependenciesKind="dependent tunable dependent"/>
    <ClockedState valueReference="14" dependencies="13 15"/>
    <InitialUnknown valueReference="5" dependencies="4"/>
    <InitialUnknown valueReference="6" dependencies="1 2 3"/>
    <InitialUnknown valueReference="7" dependencies="1 2 3 4"/>
    <InitialUnknown valueReference="9" dependencies="1" dependenciesKind="constant"/>
    <EventIndicator valueReference="10" dependencies="3"/>
  </ModelStructure>
</fmiModelDescription>
"""

BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="pendulum">
    <SourceFileSet language="C99">
      <SourceFile name="pendulum.c"/>
      <PreprocessorDefinition name="FMI3_OVERRIDE_FUNCTION_PREFIX" value="1" optional="true"/>
      <IncludeDirectory name="include"/>
    </SourceFileSet>
  </BuildConfiguration>
</fmiBuildDescription>
"""

#: Texts of the sources of both archives.
SOURCES = {
    "pendulum.c": "#define FMI2_FUNCTION_PREFIX pendulum_\n#define FMI3_FUNCTION_PREFIX pendulum_\n"
    '#include "include/model.h"\nstatic const char token[] = "{8c4e810f}";\n',
    "include/model.h": "/* no declarations */\n",
}
#: Paths of the archives of FMI 2.0 and FMI 3.0.
NAMES2 = {"modelDescription.xml", "sources/pendulum.c", "sources/include/model.h", "binaries/linux64/pendulum.so"}
NAMES3 = {
    *("modelDescription.xml", "sources/buildDescription.xml", "sources/pendulum.c", "sources/include/model.h"),
    *("binaries/x86_64-linux/pendulum.so", "documentation/index.html", "documentation/licenses/license.txt"),
}
