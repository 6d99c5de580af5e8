/* <<BANNER>> */
/* Functions of FMI 3.0 for what the model lacks: other types than doubles, clocks, structural parameters,
 * partitions. They return fmi3Error. */
#include "$_fmu.h"

fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Float32 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetFloat32", "variables of this type");
}

fmi3Status fmi3GetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Int8 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetInt8", "variables of this type");
}

fmi3Status fmi3GetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3UInt8 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetUInt8", "variables of this type");
}

fmi3Status fmi3GetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Int16 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetInt16", "variables of this type");
}

fmi3Status fmi3GetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3UInt16 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetUInt16", "variables of this type");
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Int32 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetInt32", "variables of this type");
}

fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3UInt32 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetUInt32", "variables of this type");
}

fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Int64 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetInt64", "variables of this type");
}

fmi3Status fmi3GetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3UInt64 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetUInt64", "variables of this type");
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Boolean values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetBoolean", "variables of this type");
}

fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3String values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetString", "variables of this type");
}

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)valueSizes;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetBinary", "variables of this type");
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Clock values[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  return $_fmu_lacking(instance, "fmi3GetClock", "clocks");
}

fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Float32 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetFloat32", "variables of this type");
}

fmi3Status fmi3SetInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Int8 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetInt8", "variables of this type");
}

fmi3Status fmi3SetUInt8(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3UInt8 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetUInt8", "variables of this type");
}

fmi3Status fmi3SetInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Int16 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetInt16", "variables of this type");
}

fmi3Status fmi3SetUInt16(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3UInt16 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetUInt16", "variables of this type");
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Int32 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetInt32", "variables of this type");
}

fmi3Status fmi3SetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3UInt32 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetUInt32", "variables of this type");
}

fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Int64 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetInt64", "variables of this type");
}

fmi3Status fmi3SetUInt64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3UInt64 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetUInt64", "variables of this type");
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Boolean values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetBoolean", "variables of this type");
}

fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3String values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetString", "variables of this type");
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)valueSizes;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3SetBinary", "variables of this type");
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Clock values[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)values;
  return $_fmu_lacking(instance, "fmi3SetClock", "clocks");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
  size_t *nDependencies)
{
  (void)valueReference;
  (void)nDependencies;
  return $_fmu_lacking(instance, "fmi3GetNumberOfVariableDependencies", "list of dependencies");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
  size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
  size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[], size_t nDependencies)
{
  (void)dependent;
  (void)elementIndicesOfDependent;
  (void)independents;
  (void)elementIndicesOfIndependents;
  (void)dependencyKinds;
  (void)nDependencies;
  return $_fmu_lacking(instance, "fmi3GetVariableDependencies", "list of dependencies");
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
  size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
  size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
  (void)unknowns;
  (void)nUnknowns;
  (void)knowns;
  (void)nKnowns;
  (void)seed;
  (void)nSeed;
  (void)sensitivity;
  (void)nSensitivity;
  return $_fmu_lacking(instance, "fmi3GetAdjointDerivative", "adjoint derivatives");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
  return $_fmu_lacking(instance, "fmi3EnterConfigurationMode", "structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
  return $_fmu_lacking(instance, "fmi3ExitConfigurationMode", "structural parameters");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)intervals;
  (void)qualifiers;
  return $_fmu_lacking(instance, "fmi3GetIntervalDecimal", "clocks");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
  fmi3IntervalQualifier qualifiers[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)counters;
  (void)resolutions;
  (void)qualifiers;
  return $_fmu_lacking(instance, "fmi3GetIntervalFraction", "clocks");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3Float64 shifts[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)shifts;
  return $_fmu_lacking(instance, "fmi3GetShiftDecimal", "clocks");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)counters;
  (void)resolutions;
  return $_fmu_lacking(instance, "fmi3GetShiftFraction", "clocks");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Float64 intervals[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)intervals;
  return $_fmu_lacking(instance, "fmi3SetIntervalDecimal", "clocks");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)counters;
  (void)resolutions;
  return $_fmu_lacking(instance, "fmi3SetIntervalFraction", "clocks");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Float64 shifts[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)shifts;
  return $_fmu_lacking(instance, "fmi3SetShiftDecimal", "clocks");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)counters;
  (void)resolutions;
  return $_fmu_lacking(instance, "fmi3SetShiftFraction", "clocks");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
  size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
  (void)valueReferences;
  (void)nValueReferences;
  (void)orders;
  (void)values;
  (void)nValues;
  return $_fmu_lacking(instance, "fmi3GetOutputDerivatives", "derivatives of outputs");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
  fmi3Float64 activationTime)
{
  (void)clockReference;
  (void)activationTime;
  return $_fmu_lacking(instance, "fmi3ActivateModelPartition", "partitions");
}
